"""What is flown and what breaks: cards, maneuvers, faults."""
