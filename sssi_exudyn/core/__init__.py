"""Frames, quantities with units and bounds, rotations, noise models, errors."""
