"""The reduced tree: the arm's equation of motion, its loops and its sensors, in CasADi."""
