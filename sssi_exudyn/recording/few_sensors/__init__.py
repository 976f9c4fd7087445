"""A whole posture from few sensors: attitude, course, and a model of how people ski."""
