"""A runner of a notebook's cells, one after the other as Jupyter does, without Jupyter."""

from __future__ import annotations

import ast
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any


def run_notebook(path: Path) -> tuple[dict[str, Any], list[Any]]:
    """Run the code cells in the working directory; return their names, and the value that each cell would show."""
    module = ModuleType(f"notebook_{path.stem}")
    sys.modules[module.__name__] = module  # as Jupyter's __main__ is, so that classes can be found by their names
    names: dict[str, Any] = vars(module)
    shown: list[Any] = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, str(path), "exec"), names)
        value = eval(compile(ast.Expression(last.value), str(path), "eval"), names) if last is not None else None
        shown.append(value)
    return names, shown
