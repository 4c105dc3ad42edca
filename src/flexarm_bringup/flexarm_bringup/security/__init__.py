"""Who of the graph may say and hear what: policies for DDS-Security, made from the nodes themselves."""
