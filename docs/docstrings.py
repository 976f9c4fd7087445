"""The docstrings of this program, converted for the site's reader of docstrings.

Here ``name : meaning`` is the form under Parameters; the reader expects a type after the colon.
"""

from __future__ import annotations

import re
from typing import Any, Final

from griffe import ExprSubscript, ExprTuple, Extension, Function, Object

_SECTIONS: Final = ("Parameters", "Attributes")
_ENTRY: Final = re.compile(r"^(\*{0,2}\w[\w, *]*) : (.*)$")


class PlainDocstrings(Extension):
    """Converter of every docstring to the form of numpydoc, without types, which the annotations give."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = numpydoc(obj.docstring.value)

    def on_function(self, *, func: Function, **_: Any) -> None:
        """Show a parameter's type without what its annotation says to the command line."""
        for parameter in func.parameters:
            annotation = parameter.annotation
            if isinstance(annotation, ExprSubscript) and str(annotation.left) == "Annotated":
                inner = annotation.slice
                parameter.annotation = inner.elements[0] if isinstance(inner, ExprTuple) else inner


def numpydoc(text: str) -> str:
    """Return the docstring with its prose first, then its sections; entries outside a section become a list."""
    prose: list[str] = []
    sections: dict[str, list[str]] = {}
    current, lines = "", text.split("\n")
    for i, line in enumerate(lines):
        below = lines[i + 1] if i + 1 < len(lines) else ""
        if line in (*_SECTIONS, "Examples") and re.fullmatch(r"-{4,}", below):
            current = line
            sections[current] = []
        elif re.fullmatch(r"-{4,}", line) and current and not sections[current]:
            continue
        elif current in _SECTIONS:
            entry = _ENTRY.match(line)
            if entry:
                sections[current] += [entry[1], f"    {entry[2]}"]
            elif line.startswith("    ") or not line.strip():
                sections[current].append(line)
            else:
                current = ""
                prose += ["", line]
        elif current:
            sections[current].append(line)
        else:
            entry = _ENTRY.match(line.strip())
            prose += ["", f"- `{entry[1]}`: {entry[2]}"] if entry else [line]
    parts = ["\n".join(prose).strip()]
    for name, body in sections.items():
        parts.append(f"{name}\n{'-' * len(name)}\n" + "\n".join(body).strip("\n"))
    return "\n\n".join(parts)
