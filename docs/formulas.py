"""Formulas of the site: those of docstrings as LaTeX, and LaTeX as MathML, which browsers set without help."""

from __future__ import annotations

import re
from itertools import groupby
from typing import Final

_FUNCTIONS: Final = {name: f"\\{name}" for name in ("max", "min", "cos", "tan", "exp", "tanh")} | {
    "sign": r"\operatorname{sign}"
}
_NAMES: Final = {"rho": "ρ", "delta": "δ", "mu": "μ", "delta_mu": "Δμ"}
_PROSE: Final = frozenset(
    re.findall(
        r"\S+",
        "air's addition and between default else for in is its left of one or over positive products right ski "
        "smoothed that the time to two where with within",
    )
)
_SYMBOLS: Final = {
    "²": "^{2}", "³": "^{3}", "₊": "_{+}", "ᵀ": r"^{\mathsf{T}}", "·": r"\,", "−": "-", "½": r"\tfrac{1}{2}",
    "±": r"\pm ", "Σ": r"\sum ", "…": r"\dots ", "∂": r"\partial ", " ": " ",
}  # fmt: skip
_ACCENTS: Final = {"\u0307": r"\dot", "\u0302": r"\hat"}
_TOKEN: Final = re.compile(
    r"(?P<root>√(?=\())|(?P<power>\^)|(?P<prose>(?:[a-z]+(?:'s)?)(?: [a-z]+(?:'s)?)*(?![a-z_0-9('·\u0307\u0302]))"
    r"|(?P<name>[A-Za-zΑ-Ωα-ω]+[\u0307\u0302]?\d?(?:_[A-Za-z]+)*)|(?P<number>\d+)|(?P<other>.)"
)


def latex(formula: str) -> str:
    """Return a formula of a docstring, such as ``f_t = −mu_t·ΣF_N``, as LaTeX with a line for each of its parts."""
    parts = [part.strip(" ,") for part in re.split(r",?\s{2,}", _composed(formula))]
    return r" \\ ".join(_convert(part) for part in parts if part)


def mathml(source: str, *, block: bool) -> str:
    """Return the MathML of LaTeX; the lines of a block stand below each other.

    Raises ValueError for a command that the converter does not know.
    """
    from latex2mathml.converter import convert

    lines = re.split(r"\s*\\\\\s+", source.strip()) if block else [source]
    made = "".join(convert(line, display="block" if block else "inline") for line in lines)
    if "\\" in made:
        raise ValueError(f"a command is not known: {source}")
    return made


def _composed(text: str) -> str:
    """Return the text with letters under accents as a letter and a combining accent."""
    for letter, pair in {"û": "u\u0302", "ȧ": "a\u0307"}.items():
        text = text.replace(letter, pair)
    return text


def _convert(text: str) -> str:
    result, at = "", 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        assert match is not None
        at = match.end()
        if match["root"] or (match["power"] and text[at] == "("):
            end = _closing(text, at)
            inside = _convert(text[at + 1 : end])
            result += rf"\sqrt{{{inside}}}" if match["root"] else f"^{{{inside}}}"
            at = end + 1
        elif match["power"]:
            exponent = re.compile(r"\w+").match(text, at)
            assert exponent is not None
            result += f"^{{{_name(exponent.group())}}}"
            at = exponent.end()
        elif match["prose"]:
            result += _words(match["prose"])
        elif match["name"]:
            result += _name(match["name"])
        else:
            result += _SYMBOLS.get(match.group(), match.group())
    return result


def _closing(text: str, start: int) -> int:
    """Return the place of the bracket that closes the one at ``start``."""
    depth = 0
    for at in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        if depth == 0:
            return at
    raise ValueError(f"a bracket is open: {text}")


def _words(text: str) -> str:
    """Return words in a formula: prose as text, names of numbers upright."""
    result = ""
    for prose, group in groupby(text.split(), _PROSE.__contains__):
        words = list(group)
        result += rf"\text{{ {' '.join(words)} }}" if prose else "".join(f"{_name(word)} " for word in words)
    return result


def _name(text: str) -> str:
    """Return a number's name: letters of one sign, functions and words upright, what follows an underscore below."""
    if text in _NAMES:
        return _NAMES[text]
    base, _, below = text.partition("_")
    if base == "delta" and below.startswith("mu"):
        base, _, below = "Δμ", "", below.removeprefix("mu").lstrip("_")
    elif base in _NAMES:
        base = _NAMES[base]
    return _base(base) + (f"_{{{_base(below)}}}" if below else "")


def _base(text: str) -> str:
    if text in _FUNCTIONS:
        return _FUNCTIONS[text] + " "
    if text and text[-1] in _ACCENTS:
        return _base(text[:-2]) + f"{_ACCENTS[text[-1]]}{{{text[-2]}}}" if len(text) > 1 else text
    if re.fullmatch(r"[A-Za-z]\d", text):
        return f"{text[0]}_{text[1]}"
    letters = re.match(r"[a-z]+", text)
    if letters and letters.group() in _FUNCTIONS:
        return _FUNCTIONS[letters.group()] + " " + _base(text[letters.end() :])
    if re.fullmatch(r"[A-Za-z]{2,}", text):
        return rf"\mathrm{{{text}}}"
    return text.replace("Σ", r"\sum ")
