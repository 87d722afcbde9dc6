"""The page of a type: estimates, changes, advice."""
