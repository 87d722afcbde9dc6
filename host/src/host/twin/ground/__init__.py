"""The walk round an aircraft before a flight: what hands do to it, and what its logger says."""
