"""What is kept of every flight: a Parquet dataset that a second run continues."""
