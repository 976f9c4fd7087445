"""Many runs with other parameters, on one machine or a cluster."""
