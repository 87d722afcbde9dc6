"""What is known of the aircraft beside the log: geometry, mass, instrument errors, priors."""
