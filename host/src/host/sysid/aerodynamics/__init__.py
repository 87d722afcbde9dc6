"""Dimensional derivatives and non-dimensional coefficients, at a trim and away from it."""
