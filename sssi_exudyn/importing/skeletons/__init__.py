"""Captures of systems whose segments have other names and axes than those of a recording."""
