"""Muscle forces that make the joint moments of a run."""
