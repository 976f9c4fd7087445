"""Hypotheses about snow and terrain."""
