"""The fault drill: what may go wrong, injected on purpose, with a bound for what must then happen."""
