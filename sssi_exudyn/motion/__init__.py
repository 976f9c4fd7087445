"""From motion capture to the prescribed joint angles of the chain."""
