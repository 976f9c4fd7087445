"""What a script or a notebook uses: the functions and results that ``sssi_exudyn`` itself shows."""
