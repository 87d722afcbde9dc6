"""What a user has: versions, extras, ports, caches, and the settings in force."""
