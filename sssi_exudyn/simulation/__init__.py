"""Model and motion in, time series out: the full model and the reduced one."""
