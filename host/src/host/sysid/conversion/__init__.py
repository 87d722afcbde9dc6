"""Derivatives and coefficients of each other."""
