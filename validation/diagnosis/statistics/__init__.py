"""What is found along a run, what it is worth, and what could have been found."""
