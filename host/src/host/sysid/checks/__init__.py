"""Checks of a flight's columns: units, signs, kinematics, sensors that stand still, feedback."""
