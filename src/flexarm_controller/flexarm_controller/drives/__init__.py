"""What lies between the guard and the drives: seal, attachment, and the drives' own watchdog."""
