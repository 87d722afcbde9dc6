"""Inventory of an installation: versions, extras, ports, caches, settings in force."""
