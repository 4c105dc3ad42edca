"""The spill-over gate: is the loop stable on the modes that the controller does not know, and by how much?"""
