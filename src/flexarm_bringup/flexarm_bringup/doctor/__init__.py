"""What keeps a rig from running well, found and told with what to do."""
