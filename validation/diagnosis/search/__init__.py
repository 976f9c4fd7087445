"""The search of one recording for what is missing, and what each result is worth."""
