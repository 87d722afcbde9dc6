"""Verdict of a test point while the aircraft is still in the air."""
