"""The flight itself: pilot, draws of the day, integration."""
