"""``python -m sssi_exudyn`` is ``sssi``."""

from sssi_exudyn.cli import main

if __name__ == "__main__":
    main()
