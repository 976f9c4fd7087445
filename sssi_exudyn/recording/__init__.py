"""A recording: its files, its checks, what is estimated where it is silent."""
