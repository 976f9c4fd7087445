"""Turns and the skier's biomechanics in them: joint angles, forces, moments, work."""
