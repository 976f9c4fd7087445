"""One ski in a steady turn on snow that edges cut."""
