"""A whole run of a fleet: from sources to what is kept and shown."""
