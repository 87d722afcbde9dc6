"""Identification while flying: estimates as data come, beside the half-widths that are wanted."""
