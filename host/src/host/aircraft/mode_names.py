"""What the natural modes of an aircraft are called, in flight, in truth and in an answer."""

LONGITUDINAL = SHORT_PERIOD, PHUGOID = ("short period", "phugoid")
LATERAL = DUTCH_ROLL, ROLL, SPIRAL = ("dutch roll", "roll", "spiral")
ROLL_SPIRAL = "roll and spiral"  # coupled: one oscillation in place of two roots
