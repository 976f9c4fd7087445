"""The sections of a report: each a function of the results that are shown."""
