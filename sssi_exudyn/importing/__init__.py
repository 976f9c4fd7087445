"""Recordings out of files of other formats."""
