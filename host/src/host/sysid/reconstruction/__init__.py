"""Data compatibility: flight-path reconstruction and corrections of the sensors."""
