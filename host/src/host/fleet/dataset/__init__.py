"""The Parquet dataset of all flights, which a second run continues."""
