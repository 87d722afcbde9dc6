"""Unseen data predicted: how far a right model may miss."""
