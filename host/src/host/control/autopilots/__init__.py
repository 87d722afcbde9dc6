"""The structures that named autopilots fly, each in a file of its own, with its parameters."""
