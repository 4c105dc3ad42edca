"""What comes in: sensor messages and torques, read without trust."""
