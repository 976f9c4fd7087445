"""Hypotheses about the air."""
