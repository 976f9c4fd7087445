"""Every instrument held against the others before anything is fitted: one check a file, one line in ``catalogue``."""
