"""Which logs there are, and whose each is."""
