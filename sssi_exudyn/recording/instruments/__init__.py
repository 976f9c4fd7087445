"""One reader an instrument: motion capture, GPS, insoles, single inertial sensors."""
