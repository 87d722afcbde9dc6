"""Studies that prove the estimators: each writes a table from fixed seeds."""
