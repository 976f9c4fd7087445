"""The model as pure data: skier, skis, force terms, instrument faults, start."""
