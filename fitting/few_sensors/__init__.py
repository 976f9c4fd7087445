"""Recordings of few sensors: friction from the balance of energy along the path."""
