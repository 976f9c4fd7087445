"""The first screen of a report: a light, the answer in tiles, and the replay next to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape

from sssi_exudyn.reports.answer import PLUS_MINUS, tiles_of
from sssi_exudyn.reports.diagnosis_tiles import tiles_of_diagnosis
from sssi_exudyn.reports.html import tiles_html
from sssi_exudyn.reports.section import Block, Heading, Runs, Text, Tile, Tiles
from sssi_exudyn.reports.sections.replay import replay_html
from sssi_exudyn.reports.sentences import differences, sentences
from sssi_exudyn.reports.verdict import SYMBOLS, WORDS, Verdict, verdict_of
from sssi_exudyn.results.stored import StoredRun

_OF_POSTURE: tuple[str, ...] = ("technique", "load share")
"""Tiles that rest on the posture."""


def first_screen(runs: Runs) -> str:
    """Return markup: a light and tiles of every run, the replay of a single one, and all of it in words, folded."""
    answers = [_answer(run, named=len(runs) > 1) for run in runs]
    words = _paragraphs(sentences(runs)[: len(runs)])
    below = (
        f'{_paragraphs(differences(runs))}<p class="soft">{escape(PLUS_MINUS)}</p>\n'
        f'<details class="words">\n<summary>The result in words</summary>\n{words}</details>\n'
    )
    replayed = replay_html(runs[0]) if len(runs) == 1 else ""
    if replayed:
        return f'<div class="first">\n<div class="answer">\n{answers[0]}{below}</div>\n{replayed}</div>\n'
    boxes = "".join(f'<div class="answer">\n{answer}</div>\n' for answer in answers)
    return f'<div class="first several">\n{boxes}</div>\n{below}'


def answer_blocks(runs: Runs) -> tuple[Block, ...]:
    """Return the same for a document to print: verdict and tiles of every run."""
    blocks: list[Block] = []
    for run in runs:
        verdict = verdict_of(run.summary)
        blocks += [Heading(run.name)] if len(runs) > 1 else []
        blocks += [Text(f"Verdict: {verdict.words}. {verdict.sentence}"), Tiles(answer_tiles(run))]
        blocks += [Tiles(tiles) for tiles in _diagnosis_tiles(run)]
    return (*blocks, Text(PLUS_MINUS))


def answer_tiles(run: StoredRun) -> tuple[Tile, ...]:
    """Return the tiles of a run; those of an assumed posture say so."""
    few, assumed = run.summary.posture is not None, _OF_POSTURE
    if run.summary.technique is not None:  # which follows from friction, not from the posture
        assumed = tuple(name for name in assumed if name != "technique")
    return tuple(replace(tile, assumed=few and tile.name in assumed) for tile in tiles_of(run.summary))


def _diagnosis_tiles(run: StoredRun) -> tuple[tuple[Tile, ...], ...]:
    return () if run.diagnosis is None else tiles_of_diagnosis(run.diagnosis)


def _answer(run: StoredRun, *, named: bool) -> str:
    headline = f"<h2>{escape(run.name)}</h2>\n" if named else ""
    diagnosed = "".join(tiles_html(tiles) for tiles in _diagnosis_tiles(run))
    diagnosed = f"<h3>Diagnosis</h3>\n{diagnosed}" if diagnosed else ""
    light = _light(verdict_of(run.summary))
    return f"{headline}{light}{diagnosed}{tiles_html(answer_tiles(run))}"


def _paragraphs(lines: Sequence[str]) -> str:
    return "".join(f'<p class="result">{escape(line)}</p>\n' for line in lines)


def _light(verdict: Verdict) -> str:
    """Return the light: symbol and word, colour only in addition, and the figure that decides."""
    return (
        f'<p class="light {verdict.level}"><span class="lamp" aria-hidden="true">{SYMBOLS[verdict.level]}</span>'
        f"<span><strong>{WORDS[verdict.level].capitalize()}.</strong> {escape(verdict.sentence)}</span></p>\n"
    )
