"""The logs of a fleet, and the aircraft that each belongs to."""
