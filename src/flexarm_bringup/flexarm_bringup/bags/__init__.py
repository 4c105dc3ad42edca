"""Bags of rosbag2: read, written, copied, recovered; those of others, and the record of a run."""
