"""A ski: profiles, mesh, beam, modes, identification from bench tests."""
