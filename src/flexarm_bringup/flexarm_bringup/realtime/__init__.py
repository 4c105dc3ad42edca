"""How well the graph of nodes keeps time on this machine: ``flexarm realtime``."""
