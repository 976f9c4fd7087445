"""The diagnosis tested on cases whose answers are known."""
