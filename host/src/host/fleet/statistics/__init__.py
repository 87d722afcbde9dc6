"""What many flights of many aircraft say of their type: numbers in, numbers out."""
