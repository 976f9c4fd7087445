"""References to numbers of a model: their parts, and that they are written as they are typed."""

import json
import pickle

import pytest

from sssi_exudyn.core.number_ref import FRICTION, NumberRef, number_ref, split_owner
from sssi_exudyn.runtime.cache import fingerprint


@pytest.mark.parametrize(
    ("text", "owner", "part", "ordinal", "key"),
    [
        ("friction.mu_t", "friction", "friction", 1, "mu_t"),
        ("gust#2.w_f", "gust#2", "gust", 2, "w_f"),
        ("surface.mode_12", "surface", "surface", 1, "mode_12"),
        ("nonsense", "nonsense", "nonsense", 1, ""),
    ],
)
def test_a_reference_has_its_parts(text: str, owner: str, part: str, ordinal: int, key: str) -> None:
    ref = NumberRef(text)
    assert (ref.owner, ref.part, ref.ordinal, ref.key) == (owner, part, ordinal, key)
    assert NumberRef.of(owner, key).part == part


def test_what_is_no_count_is_of_no_kind() -> None:
    assert split_owner("gust#x") == ("gust", 0)
    assert split_owner("gust#-1") == ("gust", 0)


def test_it_is_written_and_compared_as_its_text() -> None:
    ref = FRICTION[0]
    assert number_ref(ref) is ref
    assert number_ref("friction.mu_t") == ref
    assert {"friction.mu_t": 1}[ref] == 1
    assert json.dumps({ref: ref}) == '{"friction.mu_t": "friction.mu_t"}'
    assert pickle.loads(pickle.dumps(ref)).key == "mu_t"
    assert fingerprint(ref) == fingerprint("friction.mu_t")  # what was begun with text goes on
