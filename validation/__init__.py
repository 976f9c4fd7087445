"""Agreement of a simulation with measurements: figures, plots, the page that shows them."""

if __name__ == "validation":
    raise ImportError("this folder is the package sssi_exudyn.validation; import that instead")
