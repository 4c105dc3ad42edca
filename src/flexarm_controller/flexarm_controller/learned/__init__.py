"""The law learns how the arm is: softer or stiffer modes, heavier or lighter axes."""
