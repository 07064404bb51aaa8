"""What `vergence calibrate` reads, makes, draws and writes."""
