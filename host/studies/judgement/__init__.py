"""One score over worlds: what of an answer is right, what is told to be, how honest the widths."""
