"""Work cells."""
