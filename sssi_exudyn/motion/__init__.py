"""The prescribed joint angles of the chain, from motion capture."""
