"""A season on one page: where and how the runs went, what stands out, and comparisons of place, day, skier and ski."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Final
from urllib.parse import quote

import numpy as np
import pandas as pd

from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.html import document, tiles_html
from sssi_exudyn.reports.section import Block, Grid, Heading, Items, Markup, Section, Text, Tile
from sssi_exudyn.results.folder import REPORT
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.season.joint_friction import JointFriction
from sssi_exudyn.season.page_descents import about_together, together
from sssi_exudyn.season.page_figures import map_of_tracks, over_time, same_descents, technique_bars
from sssi_exudyn.sweeps.records import DONE

PAGE: Final = "season.html"
_MOST_ROWS: Final = 300
"""Maximum number of rows of a table on the page; the table's files have all of them."""
_MOST_GROUPS: Final = 40
"""Maximum number of days, skiers or places that are compared on the page."""
_RUNS: Final = (
    ("day", "day", ""), ("place", "descent", ""), ("duration_s", "s", ".0f"), ("vertical_m", "vertical, m", ".0f"),
    ("length_m", "length, m", ".0f"), ("mean_speed_mps", "mean, m/s", ".1f"), ("top_speed_mps", "top, m/s", ".1f"),
    ("turns", "turns", ".0f"), ("technique", "technique", ""), ("effective_friction", "effective friction", ".3f"),
    ("energy_lost_a_turn_J_per_kg", "energy lost in a turn, J/kg", ".1f"),
)  # fmt: skip
"""Columns of the table of runs: name, words, format."""
_COMPARED: Final = (
    ("slope_deg", "slope, °", ".1f"), ("vertical_m", "vertical, m", ".0f"),
    ("mean_speed_mps", "mean speed, m/s", ".1f"), ("top_speed_mps", "top speed, m/s", ".1f"), ("turns", "turns", ".0f"),
    ("effective_friction", "effective friction", ".3f"),
    ("energy_lost_a_turn_J_per_kg", "energy lost in a turn, J/kg", ".1f"),
)  # fmt: skip
"""Columns of a comparison, medians of runs."""


def render_season(
    table: pd.DataFrame, tracks: Mapping[str, Array], descents: Sequence[JointFriction], origin: Provenance
) -> str:
    """Return the page as text.

    Parameters
    ----------
    table : the season's table (``season_table``)
    tracks : (n, 3) latitude and longitude (deg), altitude (m) by the run's name
    descents : what the runs of each descent show together
    """
    seen = table[np.isfinite(table["duration_s"].to_numpy(dtype=float))]
    done = table[table["status"] == DONE]
    others = table[table["status"] != DONE]
    sections = [
        Section("Where the runs went", map_of_tracks(table, tracks), _about_map(table), opened=True),
        Section("Runs over time", over_time(seen), _about_time(seen), opened=True),
        Section("What stands out", _outliers(table), _about_outliers(table), opened=True),
        Section("The same descent again", (*same_descents(done), *_compare(seen, "place")), _about_places(table)),
        Section("The runs of a descent together", together(descents), about_together(descents), opened=True),
        Section("Technique", technique_bars(done), _about_technique(done)),
        *(
            Section(f"By {name}", _compare(seen, column), _about_groups(seen, column, name))
            for column, name in (("day", "day"), ("skier", "skier"), ("ski", "ski"), ("snow_kind", "kind of snow"))
        ),
        Section("Each run", _each_run(seen), f"The table has {_count(len(seen), 'run')} with the main figures."),
        Section("Without a result", _without_result(others), _about_others(others), opened=True),
        Section("Origin of this season", _origin(origin), f"The hashes of {_count(len(origin.inputs), 'recording')}."),
    ]
    lead = tiles_html(_tiles(seen, done))
    return document(_title(seen), lead, [section for section in sections if section.blocks])


def _title(table: pd.DataFrame) -> str:
    days = sorted(set(table["day"]) - {""})
    when = "" if not days else f", {days[0]}" if len(days) == 1 else f", {days[0]} to {days[-1]}"
    return f"A season of {_count(len(table), 'run')}{when}"


def _count(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _tiles(seen: pd.DataFrame, done: pd.DataFrame) -> tuple[Tile, ...]:
    days = len(set(seen["day"]) - {""})
    tiles = [
        Tile("runs", str(len(seen)), f"{len(done)} with a result" + (f", on {_count(days, 'day')}" if days else "")),
        Tile("vertical", f"{np.nansum(seen['vertical_m']):,.0f} m", "of all runs together"),
        Tile("length", f"{np.nansum(seen['length_m']) / 1000.0:,.1f} km", "along the snow"),
    ]
    if seen["top_speed_mps"].notna().any():
        fastest = seen.iloc[int(np.nanargmax(seen["top_speed_mps"].to_numpy(dtype=float)))]
        speed = float(fastest["top_speed_mps"])
        tiles.append(Tile("top speed", f"{speed:.1f} m/s", f"{3.6 * speed:.0f} km/h over 5 s, {fastest['run']}"))
    friction = done["effective_friction"].dropna()
    if len(friction):
        low, middle, high = np.quantile(friction, [0.25, 0.5, 0.75])
        tiles.append(Tile("effective friction", f"{middle:.3f}", f"median; half of the runs {low:.3f} to {high:.3f}"))
    energy = done["energy_lost_a_turn_J_per_kg"].dropna()
    if len(energy):
        tiles.append(Tile("energy lost in a turn", f"{np.median(energy):.0f} J/kg", "median of the runs"))
    return tuple(tiles)


def _about_map(table: pd.DataFrame) -> str:
    shared = table.loc[table["place"] != "", "place"]
    if shared.empty:
        return "Each descent was skied once."
    return f"{len(shared)} runs share {_count(shared.nunique(), 'descent')}; each has its letter and colour."


def _about_time(seen: pd.DataFrame) -> str:
    speed = seen["mean_speed_mps"].dropna()
    if speed.empty:
        return ""
    return f"Mean speed goes from {speed.min():.1f} to {speed.max():.1f} m/s; runs stand in the order of their time."


def _outliers(table: pd.DataFrame) -> tuple[Block, ...]:
    rows = table[table["stands_out"] != ""]
    if rows.empty:
        return ()
    lines = tuple(f"{row.run}: {row.stands_out}." for row in rows.head(_MOST_ROWS).itertuples())
    note = (
        "Runs are compared with the others of their descent where it was skied five times or more, else with those of"
        " their day. A robust standard deviation follows from the median distance to the median."
    )
    return (Items(lines), Text(note))


def _about_outliers(table: pd.DataFrame) -> str:
    count = int((table["stands_out"] != "").sum())
    verb = "differs" if count == 1 else "differ"
    return f"{_count(count, 'run')} {verb} by more than 3.5 robust standard deviations."


def _about_places(table: pd.DataFrame) -> str:
    counts = table.loc[table["place"] != "", "place"].value_counts()
    if counts.empty:
        return ""
    return f"Descent {counts.index[0]} was skied most often, {counts.iloc[0]} times."


def _about_technique(done: pd.DataFrame) -> str:
    counts = done.loc[done["technique"] != "", "technique"].value_counts()
    return ", ".join(f"{name}: {_count(count, 'run')}" for name, count in counts.items()) + "." if len(counts) else ""


def _about_groups(seen: pd.DataFrame, column: str, name: str) -> str:
    count = seen.loc[seen[column] != "", column].nunique()
    return f"The table compares medians of {count} {name if name != 'kind of snow' else 'kind'}s."


def _about_others(others: pd.DataFrame) -> str:
    counts = others["status"].value_counts()
    return ", ".join(f"{count} {status}" for status, count in counts.items()) + "."


def _compare(seen: pd.DataFrame, column: str) -> tuple[Block, ...]:
    """Return medians of the runs of each group; nothing where there is only one."""
    groups = seen[seen[column] != ""].groupby(column, sort=True)
    if groups.ngroups < (1 if column == "place" else 2):
        return ()
    rows = [["", "runs", *(words for _, words, _ in _COMPARED), "technique"]]
    for number, (name, group) in enumerate(groups):
        if number == _MOST_GROUPS:
            break
        likely = group.loc[group["technique"] != "", "technique"].value_counts()
        rows.append(
            [
                str(name),
                str(len(group)),
                *(_figure(group[figure].median(), form) for figure, _, form in _COMPARED),
                str(likely.index[0]) if len(likely) else "",
            ]
        )
    more = groups.ngroups - _MOST_GROUPS
    return (Grid(rows), *((Text(f"{more} more are in the table's file."),) if more > 0 else ()))


def _each_run(seen: pd.DataFrame) -> tuple[Block, ...]:
    """Return the table of runs, each with a link to its own page where it has one."""
    head = "".join(f'<th scope="col" class="number">{escape(words)}</th>' for _, words, _ in _RUNS)
    body = "".join(_run_row(row) for _, row in seen.head(_MOST_ROWS).iterrows())
    more = len(seen) - _MOST_ROWS
    markup = (
        f'<div class="scroll"><table>\n<thead><tr><th scope="col">run</th>{head}</tr></thead>\n'
        f"<tbody>\n{body}</tbody>\n</table></div>\n"
    )
    text = Text(
        "The files season.csv and season.parquet hold all columns" + (f" and {more} more runs." if more > 0 else ".")
    )
    return (Markup(markup), text) if len(seen) else ()


def _run_row(row: pd.Series) -> str:
    name = escape(str(row["run"]))
    if row["status"] == DONE:
        name = f'<a href="{quote(str(row["run"]))}/{REPORT}">{name}</a>'
    cells = "".join(
        f'<td class="number">{escape(str(row[column]) if not form else _figure(row[column], form))}</td>'
        for column, _, form in _RUNS
    )
    return f'<tr><th scope="row">{name}</th>{cells}</tr>\n'


def _without_result(others: pd.DataFrame) -> tuple[Block, ...]:
    if others.empty:
        return ()
    rows = [["run or file", "outcome", "reason"]]
    rows += [[str(cell) for cell in row] for row in others[["run", "status", "error"]].head(_MOST_ROWS).to_numpy()]
    return (Grid(rows),)


def _origin(origin: Provenance) -> tuple[Block, ...]:
    versions = [["program", "version"], *([name, version] for name, version in origin.versions.items())]
    settings = [["setting", "value"], *([name, str(value)] for name, value in origin.settings.items())]
    hashes = [[name, digest] for name, digest in list(origin.inputs.items())[:_MOST_ROWS]]
    blocks: list[Block] = [Heading("Versions"), Grid(versions)]
    if len(settings) > 1:
        blocks += [Heading("Settings"), Grid(settings)]
    return (*blocks, Heading("Recordings"), Grid([["recording", "SHA-256 of its files"], *hashes]))


def _figure(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else ""
