"""Each flight's identification as a task in a child process that may fail."""
