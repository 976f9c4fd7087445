"""Runs on snow that edges cut, by the reduced model; and one ski in a steady turn on it."""
