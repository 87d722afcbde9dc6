"""Expressions of a user's model: grammar, exact slopes, machine code."""
