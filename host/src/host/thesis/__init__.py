"""What belongs to the thesis alone: its networks, its other estimators, its printed models."""
