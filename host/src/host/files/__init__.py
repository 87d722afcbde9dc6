"""The door for files of the user: what is read, and how much of it."""
