"""Identification while flying: estimates as data come, against the half-widths that are wanted."""
