"""Non-dimensional coefficients straight from flight."""
