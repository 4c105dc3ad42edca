"""From a file of measurements to modes: sources, the command, its page."""
