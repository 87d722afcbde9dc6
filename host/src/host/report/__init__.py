"""Pages made after landing: the flight's page, pictures, the report."""
