"""What is said of an aircraft before it flies: a handbook, a vortex lattice, a table."""
