"""Makes ``docs/diagnosis-benchmark.md`` of the blind benchmark's answers, which ``docs/diagnosis-benchmark.parquet`` holds.

    python docs/make_benchmark.py FOLDER COMMIT   keep the answers of a folder that ``sssi benchmark diagnosis`` made
    python docs/make_benchmark.py                 make the page of what is kept

COMMIT names the version that answered.  Of each diagnosis the curves over time are left out.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.io.parquet import read_texts
from sssi_exudyn.io.typed import decode, read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.benchmark.page import benchmark_page
from sssi_exudyn.validation.benchmark.run import SEAL
from sssi_exudyn.validation.benchmark.scores import CaseResult, Scores, score

DOCS = Path(__file__).parent
KEPT = DOCS / "diagnosis-benchmark.parquet"
PAGE = DOCS / "diagnosis-benchmark.md"
TEXT = DOCS / "diagnosis-benchmark-text.txt"
"""What stands below the figures."""


def keep(folder: Path, commit: str) -> None:
    """Keep the answers of a benchmark's folder, a row a case that was diagnosed."""
    rows = []
    for path in sorted((folder / "made").glob("*.json")):
        case = read_json(path, Case)
        answered = folder / f"case_{case.index:03d}.json"
        if not answered.exists():
            continue
        result = read_json(answered, CaseResult)
        if result.diagnosis is not None:
            short = replace(result.diagnosis, latent_force=None, track_distance=None, way=None)
            result = replace(result, diagnosis=short)
        rows.append((to_json(case), to_json(result)))
    seal = (folder / SEAL).read_text(encoding="utf-8").strip()
    table = pa.table({"case": [c for c, _ in rows], "result": [r for _, r in rows]})
    columns = {"seal": pa.array([seal] * len(rows)), "commit": pa.array([commit] * len(rows))}
    for name, column in columns.items():
        table = table.append_column(name, column)
    pq.write_table(table, KEPT, compression="zstd")


def kept_scores() -> tuple[Scores, str]:
    """The figures of what is kept, and the version that answered."""
    rows = read_texts(KEPT, ("case", "result", "seal", "commit"))
    cases, results = [], []
    for case, result, _, _ in rows:
        assert case is not None
        assert result is not None
        cases.append(decode(case.encode(), Case))
        results.append(decode(result.encode(), CaseResult))
    _, _, seal, commit = rows[0]
    return score(cases, results, seal or ""), commit or ""


def page() -> str:
    """The page."""
    scores, commit = kept_scores()
    text = TEXT.read_text(encoding="utf-8").replace("COMMIT", commit)
    return f"{benchmark_page(scores)}\n{text}"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        keep(Path(sys.argv[1]), sys.argv[2])
    PAGE.write_text(page(), encoding="utf-8")
