"""Recordings made from files of other formats."""
