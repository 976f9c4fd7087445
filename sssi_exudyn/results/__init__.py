"""A result's folder: its files, written and read back."""
