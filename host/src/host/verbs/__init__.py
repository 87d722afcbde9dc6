"""One module per verb of the command line: each reads arguments and prints the answer."""
