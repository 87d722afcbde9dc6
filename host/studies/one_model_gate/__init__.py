"""The gate of a trial: the whole flight as one model, against coefficients on the same flights."""
