"""Muscles: their table, paths over bones, force curves, OpenSim models."""
