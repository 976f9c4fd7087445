"""What a recording states of the snow, of its date and of its skier; and what follows for friction."""

from __future__ import annotations

from pathlib import Path

import pytest
from tiny import TOML, Tiny

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.fitting.snow_prior import GLIDES, glide_prior
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.snow import SnowConditions

DATED = TOML.replace('name = "tiny"\n', 'name = "tiny"\nbegan = 2026-02-17T10:12:00+01:00\n')


def test_date_skier_and_snow_are_read_in_si(tmp_path: Path) -> None:
    toml = DATED.replace("[skier]\n", '[skier]\nname = "Ada"\n')
    toml += '\n[snow]\nkind = "wet"\nsnow_temperature_C = -0.5\nair_temperature_C = 4\nwax = "yellow"\n'
    recording = read_recording(Tiny(toml).write(tmp_path / "run"))
    assert recording.began == 1771319520.0  # 09:12 UTC
    assert recording.skier.name == "Ada"
    assert recording.snow == SnowConditions(277.15, 272.65, "wet", "yellow")


def test_a_recording_without_them_is_as_before(tmp_path: Path) -> None:
    recording = read_recording(Tiny().write(tmp_path / "run"))
    assert (recording.began, recording.snow, recording.skier.name) == (None, None, "")
    assert glide_prior(recording.snow) is None


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ('[snow]\nkind = "slush"', "'slush' is no kind of snow"),
        ("[snow]\nkind = 3", "'3' is no kind of snow"),
        ("[snow]\nsnow_temperature_C = 2.0", r"2 is outside -50 to 0 C"),
        ("[snow]\nair_temperature_C = 270.0", r"270 is outside -50 to 40 C"),
        ("[snow]\ntemperature_C = -2.0", "unknown key"),
    ],
)
def test_mistakes_are_one_line(tmp_path: Path, lines: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        read_recording(Tiny(f"{TOML}\n{lines}\n").write(tmp_path / "run"))


@pytest.mark.parametrize("began", ['"2026-02-17"', "2026-02-17", "2026-02-17T10:12:00", "12"])
def test_a_date_without_its_zone_is_refused(tmp_path: Path, began: str) -> None:
    with pytest.raises(InputError, match="no date and time of day with its zone"):
        read_recording(Tiny(DATED.replace("2026-02-17T10:12:00+01:00", began)).write(tmp_path / "run"))


@pytest.mark.parametrize(
    ("snow", "condition"),
    [
        (SnowConditions(), "any"),
        (SnowConditions(kind="icy"), "any"),
        (SnowConditions(snow_temperature=270.15), "least"),
        (SnowConditions(snow_temperature=260.0, air_temperature=275.0), "cold"),
        (SnowConditions(snow_temperature=273.0), "melting"),
        (SnowConditions(air_temperature=275.0), "melting"),
        (SnowConditions(air_temperature=265.0), "any"),  # the snow may be warmer or colder
        (SnowConditions(kind="wet"), "melting"),
    ],
)
def test_friction_beforehand_follows_from_what_is_stated(snow: SnowConditions, condition: str) -> None:
    prior = glide_prior(snow)
    assert prior is not None
    assert prior == GLIDES[condition]  # type: ignore[index]
    # all that was measured lies within two standard deviations, wherever the mean is
    assert max(prior.mean - 0.023, 0.139 - prior.mean) <= 2.0 * prior.sigma
    assert f"{prior.mean:.3f} ± {prior.sigma:.3f}" in prior.sentence
