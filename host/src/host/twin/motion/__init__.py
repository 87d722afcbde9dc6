"""How the aircraft moves: rigid body, air, propulsion, trim, linearisation."""
