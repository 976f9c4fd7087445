"""The snow surface where it is not a plane: its representation, and its estimate from heights."""
