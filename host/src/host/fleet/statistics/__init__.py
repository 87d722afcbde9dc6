"""Statistics of a type from many flights of many aircraft: numbers in, numbers out."""
