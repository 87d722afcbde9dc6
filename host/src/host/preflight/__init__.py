"""The checks before a flight: each turns green by itself when its motion is seen."""
