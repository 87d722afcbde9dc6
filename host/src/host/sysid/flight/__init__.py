"""Columns of a flight, prepared once for both estimators."""
