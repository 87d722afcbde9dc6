"""Linear models of a flight: fitted, their intervals, validated."""
