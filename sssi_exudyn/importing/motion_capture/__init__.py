"""Captures of motion in the formats of other systems, whose segments have names and axes of their own."""
