"""Force laws traced, differentiated, written as Python and compiled."""
