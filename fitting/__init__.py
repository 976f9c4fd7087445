"""From recorded motion to the friction that explains it: parameters, objective, optimiser, uncertainty."""

if __name__ == "fitting":
    raise ImportError("this folder is the package sssi_exudyn.fitting; import that instead")
