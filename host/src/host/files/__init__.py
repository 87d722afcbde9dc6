"""Checked reading of the user's files, with limits on their size."""
