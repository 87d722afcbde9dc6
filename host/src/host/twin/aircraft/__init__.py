"""Aircraft files and where their derivatives come from."""
