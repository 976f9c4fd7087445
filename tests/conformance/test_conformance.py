"""The rules of force terms: every term keeps them, the registry's and the examples for places still without a term."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from typing import Any

import numpy as np
import pytest
from term_examples import CLASSES

from sssi_exudyn.contact.conformance import RULES, Rule
from sssi_exudyn.contact.conformance_states import assert_close, instances, reference
from sssi_exudyn.contact.registry import PAPER_TERMS, TERMS, read_term, term_named, terms_table
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities


@pytest.mark.parametrize(
    ("rule", "cls"),
    [
        pytest.param(rule, cls, id=f"{rule.name}-{cls.name}", marks=[pytest.mark.long] if rule.compiles else [])
        for rule in RULES
        for cls in CLASSES
        if not rule.kinds or cls.kind in rule.kinds
    ],
)
def test_rule(rule: Rule, cls: type[Any]) -> None:
    rule.check(cls)


def test_names_are_unique() -> None:
    assert len({cls.name for cls in TERMS}) == len(TERMS)
    assert [term_named(cls.name) for cls in TERMS] == list(TERMS)
    assert {row["name"] for row in terms_table()} == {cls.name for cls in TERMS}


@pytest.mark.parametrize("cls", TERMS, ids=lambda cls: cls.name)
def test_parameters_survive_a_file(cls: type[Any]) -> None:
    for term in instances(cls):
        text = "\n".join(f"{name} = {value!r}" for name, value in parameters(term).items())
        assert read_term(cls.name, tomllib.loads(text), "model.toml", "[term]") == term


@pytest.mark.parametrize("cls", TERMS, ids=lambda cls: cls.name)
def test_parameters_out_of_bounds_are_refused(cls: type[Any]) -> None:
    for about in quantities(cls).values():
        with pytest.raises(InputError, match=rf"model.toml: \[term\] {about.name}"):
            read_term(cls.name, {about.name: about.high + 1.0}, "model.toml", "[term]")


def test_an_unknown_term_is_refused() -> None:
    with pytest.raises(InputError, match="no force term is named 'glue'"):
        read_term("glue", {}, "model.toml", "[term]")


@pytest.mark.parametrize(
    "cls", [c for c in TERMS if c not in map(type, PAPER_TERMS) and not c.replaces], ids=lambda cls: cls.name
)
def test_a_term_beyond_the_paper_is_nothing_by_default(cls: type[Any]) -> None:
    # so that adding it changes no result; one that stands in the place of the paper's is not added to them
    assert not np.any(reference(cls()))


@pytest.fixture(scope="module")
def symbolic_values() -> dict[str, list[list[list[float]]]]:
    # Exudyn's symbols may take the process with them, and their settings are global to it
    done = subprocess.run(
        [sys.executable, "-c", "import term_examples; print(term_examples.printed_by_exudyn())"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
        capture_output=True,
        text=True,
    )
    values: dict[str, list[list[list[float]]]] = json.loads(done.stdout.splitlines()[-1])
    return values


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.name)
def test_symbols_equal_floats(cls: type[Any], symbolic_values: dict[str, list[list[list[float]]]]) -> None:
    for term, values in zip(instances(cls), symbolic_values[cls.name], strict=True):
        assert_close(np.array(values), reference(term))
