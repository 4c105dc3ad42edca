"""Which samples are believed: checks, gate, short-term memory, health."""
