"""One file per method, behind the door `fit`."""
