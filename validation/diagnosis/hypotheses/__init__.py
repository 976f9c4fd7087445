"""Each hypothesis of what may be missing: one class in one file, one line in ``catalogue``."""
