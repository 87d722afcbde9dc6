"""Coefficients predicted before the flight: from a handbook, a vortex lattice, a table."""
