"""Several runs of one day: a joint fit, a regression of friction, a second pass over the same place."""
