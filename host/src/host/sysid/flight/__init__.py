"""A whole flight: files, maneuvers found, linear models fitted and validated."""
