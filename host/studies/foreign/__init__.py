"""An aircraft flown by equations that share nothing with the package, and what is read of it."""
