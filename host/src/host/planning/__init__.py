"""What to fly: it may know the virtual flight and identification."""
