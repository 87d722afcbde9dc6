"""Identification as one pipeline: flights in, one answer out."""
