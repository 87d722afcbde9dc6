"""Gains of one identified flight, flown in closed loop by the twin's equations of motion."""
