"""What a script, a notebook or the command line uses: one function a command, and results.

``sssi_exudyn`` itself shows most of them.  Each loads what it needs when it is called, so that importing the package
takes milliseconds and starts no solver.  Recordings and results are given as objects or as their folders; without
``out`` nothing is written.
"""
