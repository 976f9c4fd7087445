"""Simulated runs of one recording with known causes, and what the recording looks like among them."""
