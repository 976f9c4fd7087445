"""Causes that no hypothesis of the list describes, one family a file."""
