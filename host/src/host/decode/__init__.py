"""Decode a log: write its table, summarise it."""
