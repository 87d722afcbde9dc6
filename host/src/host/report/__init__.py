"""What is shown of a flight after landing: a page, pictures, a report."""
