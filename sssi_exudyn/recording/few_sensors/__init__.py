"""A whole posture from few sensors: attitude, course, a model of how people ski."""
