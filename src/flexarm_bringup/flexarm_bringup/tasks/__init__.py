"""What an arm does: moves as data, worked out into references for its axes."""
