"""Use of the workers in sweeps: runs of the reduced model on the example recordings, by pool and workers.

    python benchmarks/speed/sweep.py --json FILE [--runs 500] [--blocks 5]

Pools take turns block by block, so that other work on the machine affects all of them.  For each pool

- span: s from the first run's beginning to the last one's end, summed over the blocks;  start: s before that
- speed-up and efficiency: of spans, against one process
- busy: share of workers' spans that they spent in runs, which other work on the machine does not change much
- cpu: s of a core's time a run;  parent: the same of the process that hands the runs out, tables included
- memory: MB of a worker's at its tenth, middle and last run

and handing: s of the parent's core for submitting a run and receiving its end, with runs that do nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import pandas as pd

from sssi_exudyn.core.choices import Cluster
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.file import sweep_from
from sssi_exudyn.sweeps.plan import plan_sweep
from sssi_exudyn.sweeps.workers.pools import pool_of
from sssi_exudyn.sweeps.workers.scheduler import Work, do_all

EXAMPLES = Path(__file__).parents[2] / "examples"
POOLS: tuple[tuple[str, int, dict[str, Any]], ...] = (
    ("processes", 1, {}),
    ("processes", 2, {}),
    ("processes", 4, {}),
    ("dask", 2, {"cluster": "local"}),
    ("dask", 4, {"cluster": "local"}),
)


def block(folder: Path, number: int, size: int, workers: int, options: dict[str, Any]) -> pd.DataFrame:
    """Do a block of ``size`` runs and return its timings, with the s before its first run began."""
    count = size // 2
    low, high = 0.04 + 0.001 * number, 0.12 + 0.001 * number
    settings = {
        "format": 1,
        "recordings": [str(EXAMPLES / name) for name in ("beginner", "intermediate")],
        "parameter": [{"name": "friction.mu_t", "low": low, "high": high, "count": count}],
    }
    begin, parent = time.time(), time.process_time()
    counts = sweeps.sweep(settings, folder, workers=workers, **options)
    assert counts["done"] == 2 * count
    assert counts["repeated"] == 0
    timings = pd.read_parquet(folder / "timings.parquet")
    timings["start"] = timings["begin"].min() - begin
    timings["parent"] = (time.process_time() - parent) / len(timings)
    return timings.sort_values("end")


def nothing(_folder: Path, _task: bytes) -> str:
    """Do a run that takes no time."""
    return "done"


def handing(cluster: Cluster | None, count: int = 2000) -> float:
    """Return s of this process's core for each of ``count`` runs that do nothing, between the first and last end."""
    low = {"name": "friction.mu_t", "low": 0.04, "high": 0.12, "count": count}
    settings = {"format": 1, "recordings": [str(EXAMPLES / "beginner")], "parameter": [low]}
    plan = plan_sweep(sweep_from(settings, Path("sweep")))
    times: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        work = Work(Path(folder), plan.job, nothing, "another call")
        do_all(work, plan.runs(), pool_of(None, cluster, Path(folder)), 2, lambda *_: times.append(time.process_time()))
    return (times[-1] - times[0]) / (count - 1)


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--json", type=Path, required=True)
    arguments.add_argument("--runs", type=int, default=500)
    arguments.add_argument("--blocks", type=int, default=5)
    options = arguments.parse_args()
    timings_of: dict[tuple[str, int], list[pd.DataFrame]] = {}
    loads = []
    for number in range(options.blocks):
        for name, workers, pool_options in POOLS:
            with tempfile.TemporaryDirectory() as folder:
                loads.append(os.getloadavg()[0])
                timings = block(Path(folder) / "out", number, options.runs // options.blocks, workers, pool_options)
                timings_of.setdefault((name, workers), []).append(timings)
    rows = []
    one = None
    for (name, workers), blocks in timings_of.items():
        spans = [float(timings["end"].max() - timings["begin"].min()) for timings in blocks]
        span = sum(spans)
        one = one or span
        memory = [
            memory_of_worker.to_numpy()
            for timings in blocks
            for _, memory_of_worker in timings.groupby("worker")["memory_MB"]
        ]
        runs = pd.concat(blocks)
        rows.append(
            {
                "pool": name,
                "workers": workers,
                "runs": len(runs),
                "span_s": span,
                "start_s": [float(timings["start"].iloc[0]) for timings in blocks],
                "speed_up": one / span,
                "efficiency": one / span / workers,
                "busy": float(runs["wall_s"].sum()) / (workers * span),
                "cpu_s": float(runs["cpu_s"].mean()),
                "parent_s": float(runs["parent"].mean()),
                "memory_MB": [
                    float(most)
                    for most in (
                        max(m[min(9, len(m) - 1)] for m in memory),
                        max(m[len(m) // 2] for m in memory),
                        max(m[-1] for m in memory),
                    )
                ],
            }
        )
        print(json.dumps(rows[-1]))
    hands = {"processes": handing(None), "dask": handing("local")}
    print(json.dumps(hands))
    figures = {"load": loads, "pools": rows, "handing_s": hands}
    options.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
