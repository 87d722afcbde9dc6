"""Calibration on the bench: from held positions to lines with their deviations and doubts."""
