"""Flight cards: maneuvers and faults."""
