"""From measured signals to modes: spectra, poles of every order, what lasts, refinement, all automatic."""
