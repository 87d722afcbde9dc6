"""From a request to files and words: what is written of a log, and what is said of it."""
