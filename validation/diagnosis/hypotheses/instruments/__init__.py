"""Hypotheses about faults of the instruments."""
