"""The model of a type from the flights of its fleet."""
