"""The snow surface where it is no plane: its representation, and its estimate from heights."""
