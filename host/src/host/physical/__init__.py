"""From frames to a table in SI: calibration, sampling instants, air data."""
