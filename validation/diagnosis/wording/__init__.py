"""A diagnosis in words: the sentence that it begins with, and a paragraph for a coach."""
