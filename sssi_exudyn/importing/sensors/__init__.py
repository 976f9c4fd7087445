"""Logs of inertial sensors, telephones and insoles, as their programs export them."""
