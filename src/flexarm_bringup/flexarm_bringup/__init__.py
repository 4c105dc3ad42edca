"""Launch, simulated rig, bags and the flexarm command: what a lab starts (no ROS outside node files)."""
