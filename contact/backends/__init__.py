"""Force terms evaluated: compiled, NumPy, symbolic, plain Python."""
