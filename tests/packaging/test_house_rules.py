"""House rules that a checker can see: short functions, sentences in docstrings, names that say what they hold.

``house_rules.json`` next to this file holds what does not follow them yet, by rule and file.  It only shrinks: what is
not in it fails, and so does an entry that is no longer needed.  Run as a script, this file writes it again.
"""

from __future__ import annotations

import ast
import gc
import json
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ("sssi_exudyn", "bodies", "contact", "fitting", "validation")
EXCEPTIONS = Path(__file__).with_name("house_rules.json")
FRAGMENTS = {
    "about", "as", "at", "besides", "between", "by", "each", "every", "for", "from", "how", "if", "in", "into",
    "likewise", "of", "on", "once", "one", "so", "such", "that", "these", "this", "those", "to", "what", "when",
    "where", "whether", "which", "who", "whose", "with",
}  # fmt: skip
"""Words that begin no sentence of the form "Return the load on each ski." or "The load on each ski."."""
SAYS_NOTHING = {"found", "each", "anew", "beside", "told"}
"""Names that do not say what a variable holds."""
STOPS_A_READER = re.compile(r"\b(anew|whoever|nobody)\b", re.IGNORECASE)


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def sources(*folders: str) -> Iterator[tuple[str, ast.Module]]:
    """Every file of these folders by its path from the root, and its syntax tree; what links lead to comes once."""
    for folder in folders:
        for directory, _, names in os.walk(ROOT / folder):  # follows no links
            for path in sorted(Path(directory) / name for name in names if name.endswith(".py")):
                yield path.relative_to(ROOT).as_posix(), tree_of(path)


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def too_complex() -> Iterator[tuple[str, str]]:
    """Yield the file and name of every function with more than 15 branches (C901) or 8 arguments (PLR0913)."""
    command = [sys.executable, "-m", "ruff", "check", "--no-cache", "--ignore-noqa", "--exit-zero", "--quiet"]
    command += ["--output-format", "json", "--select", "C901,PLR0913", "--config", "lint.mccabe.max-complexity = 15"]
    command += ["--config", "lint.pylint.max-args = 8", "--config", "lint.per-file-ignores = {}", *PACKAGE]
    rows = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
    trees = dict(sources(*PACKAGE))
    for row in rows:
        path = Path(row["filename"]).relative_to(ROOT).as_posix()
        if path in trees:  # and not the same by a link
            (name,) = [node.name for node in functions(trees[path]) if node.lineno == row["location"]["row"]]
            yield path, f"{name} {row['code']}"


def fragments() -> Iterator[tuple[str, str]]:
    """Yield the file and name of every function whose docstring does not open with a sentence."""
    for path, tree in sources(*PACKAGE):
        for node in functions(tree):
            first = re.match(r"[A-Za-z]+", (ast.get_docstring(node) or "").strip())
            if first and first.group().lower() in FRAGMENTS:
                yield path, node.name


def empty_names() -> Iterator[tuple[str, str]]:
    """Yield the file and name of every variable that does not say what it holds."""
    for path, tree in sources(*PACKAGE, "tests", "docs", "benchmarks"):
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in SAYS_NOTHING:
                yield path, node.id


def obscure_words() -> Iterator[tuple[str, str]]:
    """Yield the file and word of every docstring's word that makes a reader stop."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for path, tree in sources(*PACKAGE):
        for node in ast.walk(tree):
            if isinstance(node, kinds):
                for word in STOPS_A_READER.findall(ast.get_docstring(node) or ""):
                    yield path, word.lower()


def imports_of_tests() -> Iterator[tuple[str, str]]:
    """Yield the file of every test that imports another, and the other."""
    for path, tree in sources("tests"):
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("test_"):
                yield path, str(node.module)


RULES = {
    "functions too complex": too_complex,
    "docstrings that open as fragments": fragments,
    "variables that do not say what they hold": empty_names,
    "words that make a reader stop": obscure_words,
    "tests that import tests": imports_of_tests,
}


def broken(rule: str) -> dict[str, int]:
    """Count what breaks a rule, by file and what it is."""
    gc.disable()  # it would go through all syntax trees again and again as they grow
    try:
        return dict(sorted(Counter(f"{path} {what}" for path, what in RULES[rule]()).items()))
    finally:
        gc.enable()


@pytest.mark.parametrize("rule", RULES)
def test_what_breaks_a_rule_only_shrinks(rule: str) -> None:
    assert broken(rule) == json.loads(EXCEPTIONS.read_text(encoding="utf-8"))[rule]


def test_a_folder_holds_what_one_can_survey() -> None:
    # some 15 modules; more than 20 are too many
    modules = Counter(Path(path).parent.as_posix() for path, _ in sources(*PACKAGE))
    assert max(modules.values()) <= 20


if __name__ == "__main__":
    EXCEPTIONS.write_text(json.dumps({rule: broken(rule) for rule in RULES}, indent=1) + "\n", encoding="utf-8")
