"""Readers of instruments, one per instrument: motion capture, GPS, insoles, single inertial sensors."""
