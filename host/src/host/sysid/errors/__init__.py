"""What errors of instrument, sampling and trim leave open in an estimate."""
