"""Frames to a table in SI: calibration, instants, air data."""
