"""What an instrument may be wrong by."""
