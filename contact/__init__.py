"""What pushes: the force terms, their registry, and their translation into fast code."""

if __name__ == "contact":
    raise ImportError("import sssi_exudyn.contact, not contact: the folder is a part of the package sssi_exudyn")
