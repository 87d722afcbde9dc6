"""An instrument on the bench: held positions in, lines with their deviations and doubts out."""
