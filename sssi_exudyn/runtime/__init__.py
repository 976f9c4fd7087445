"""How the program runs: cache, compilation, progress, provenance, workers."""
