"""Turns and what a skier does in them: joint angles, forces, moments, work."""
