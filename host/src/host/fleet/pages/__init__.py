"""What a fleet says, on a page."""
