"""Errors that an instrument may have, with one standard deviation each."""
