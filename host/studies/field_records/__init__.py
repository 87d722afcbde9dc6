"""Flights with the errors that records of real aircraft have, drawn anew for each."""
