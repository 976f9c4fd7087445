"""Muscle forces that made the joint moments of a run."""
