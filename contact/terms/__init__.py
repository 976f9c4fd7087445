"""Force terms, one file a law."""
