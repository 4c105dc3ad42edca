"""What an arm is: bodies, joints, sensors, laws of its parameters, as data without any computation."""
