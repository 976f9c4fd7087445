"""The reduced model: its steps, its derivatives, its run."""
