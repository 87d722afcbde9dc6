"""One module per verb of the command line: arguments in, printed answer out, no work."""
