"""What is fitted to what, and what comes back: models, maneuvers, results."""
