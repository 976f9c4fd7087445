"""Tests of the diagnosis on cases with known answers."""
