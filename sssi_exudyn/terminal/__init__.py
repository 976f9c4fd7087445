"""The commands of ``sssi``: their arguments, made from signatures of ``api``, and their results as text."""
