"""What has mass: the skier's segments and the skis."""

if __name__ == "bodies":
    raise ImportError("import sssi_exudyn.bodies instead")
