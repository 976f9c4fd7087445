"""Hypotheses about what the skier does, and a force that nothing explains."""
