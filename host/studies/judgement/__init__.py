"""One score over worlds: what of an answer is right, what is called right, are widths honest."""
