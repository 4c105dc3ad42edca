"""Every law and every open-loop motion beside each other, for the same move in the same time."""
