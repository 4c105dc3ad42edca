"""Who is to blame when the state has been widened, and yet the sensors contradict each other."""
