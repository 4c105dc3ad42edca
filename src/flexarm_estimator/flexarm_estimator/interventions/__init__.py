"""What a user may do to the estimator while it runs: each is checked, recorded, and applied at its stamp."""
