"""The text rows of the original logger."""
