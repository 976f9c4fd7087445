"""A recording: its files, its checks, and the estimates for what it leaves out."""
