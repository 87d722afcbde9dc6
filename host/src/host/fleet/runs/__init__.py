"""A whole run of a fleet: from sources to dataset, models and page."""
