"""Test points of a flight: found, graded, cut."""
