"""The aircraft: what it is, how it moves, and what is known of it before a flight."""
