"""Many runs with varied parameters, on one machine or a cluster."""
