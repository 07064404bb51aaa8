"""vergence: visual servoing that keeps the target in view and the arm clear of its limits."""
