"""The full model on Exudyn: its system, its forces, its run and its series."""
