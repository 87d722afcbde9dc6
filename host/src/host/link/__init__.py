"""The USB line: ports, bytes to lines, lines to values."""
