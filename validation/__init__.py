"""How well a simulation agrees with what was measured: figures, plots, the page that shows them."""

if __name__ == "validation":
    raise ImportError("this folder is the package sssi_exudyn.validation; import that instead")
