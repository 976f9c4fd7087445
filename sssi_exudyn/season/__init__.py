"""A season: many recorded runs fitted one by one, one table of them, and one page."""
