"""Technique from telephones against what people wrote down: carving, skidding, wedge.

``python benchmarks/turns/turn_style.py FOLDER… --labels CSV [--frozen] [--train TOML] [--json FILE]``: the folders hold
pairs ``NAME_imu.csv`` and ``NAME_gnss.csv`` as ``sssi import`` reads them, the labels a row ``run,technique`` for each.
How a name begins says the technique: carving, skidded, snowplow; others are listed and not counted.

Without ``--frozen`` every run is judged by a model trained on all others (leave one out); with it by the one that comes
with the program, on runs that it was not trained on.  ``--train`` writes a model trained on all runs.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from sssi_exudyn import import_files
from sssi_exudyn.analysis.turn_style import FEATURES, STYLES, StyleModel, style_features, style_model
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import path_data
from sssi_exudyn.fitting.few_sensors.path_balance import PathEstimate, estimate_path
from sssi_exudyn.importing.answers import AnswerOptions
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, prepare

NAMES = {"carving": 0, "skidded": 1, "snowplow": 2}
EQUIPMENT: Final[AnswerOptions] = {
    "mass_kg": 75.0,
    "height_m": 1.75,
    "sex": "male",
    "skis": "all_mountain_172",
    "ski_mass_kg": 2.5,
    "boot_mass_kg": 2.0,
    "ankle_to_ski_base_m": 0.13,
    "antenna_joint": "Hips",
    "antenna_offset_m": (0.0, 0.0, 0.0),
}
"""Assumed, as it was not written down."""
RIDGE = 1.0
"""Half of the inverse variance of standardised weights; 0.3 and 3 change areas under the curve by 0.02 at most."""


def class_of(technique: str) -> int | None:
    """Return the index in ``STYLES``; None for a technique that is none of them."""
    return NAMES.get(technique.split("_")[0])


def path_of(sensors: Path, fixes: Path) -> PathEstimate:
    """Return the balance along the path of a telephone's run, as the program computes it."""
    with tempfile.TemporaryDirectory() as folder:
        recording = import_files([f"pocket={sensors}", str(fixes)], Path(folder) / "run", **EQUIPMENT)
        motion = motion_from_recording(recording)
        model = model_of(recording, motion)
        return estimate_path(path_data(recording, motion, model, prepare(model, motion, step=10.0 * COARSE_STEP)))


def train(features: Array, classes: Array) -> StyleModel:
    """Return the regression of features (n, 3) on classes (n,), each class counting by the root of its number."""
    mean, deviation = features.mean(axis=0), features.std(axis=0)
    scaled = (features - mean) / deviation
    counts = np.bincount(classes, minlength=len(STYLES))
    weight = 1.0 / np.sqrt(np.maximum(counts, 1.0))[classes]
    weight *= len(classes) / weight.sum()
    truth = np.eye(len(STYLES))[classes]
    design = np.column_stack([np.ones(len(classes)), scaled])

    def misfit(flat: Array) -> tuple[float, Array]:
        weights = flat.reshape(len(STYLES), -1)
        scores = design @ weights.T
        scores -= scores.max(axis=1, keepdims=True)
        shares = np.exp(scores) / np.exp(scores).sum(axis=1, keepdims=True)
        ridge = np.column_stack([np.zeros(len(STYLES)), weights[:, 1:]])
        value = -float(weight @ np.log(np.sum(shares * truth, axis=1) + 1e-300)) + 0.5 * RIDGE * float(np.sum(ridge**2))
        return value, (((shares - truth) * weight[:, None]).T @ design + RIDGE * ridge).ravel()

    best = minimize(misfit, np.zeros(len(STYLES) * design.shape[1]), jac=True, method="L-BFGS-B").x
    weights = best.reshape(len(STYLES), -1)
    return StyleModel(mean, deviation, weights[:, 0], weights[:, 1:])


def area(low: Array, high: Array) -> float | None:
    """Return the probability that one of ``high`` is above one of ``low``; None without any of one kind."""
    if not len(low) or not len(high):
        return None
    return float(np.mean((low[:, None] < high) + 0.5 * (low[:, None] == high)))


def figures(shares: Array, classes: Array) -> dict[str, float | int | None]:
    """Return what the probabilities (n, 3) are worth on runs of known classes (n,)."""
    odds = np.log(np.maximum(shares, 1e-12))
    skid, wedge = odds[:, 1] - odds[:, 0], odds[:, 2] - odds[:, 1]
    return {
        "runs": len(classes),
        "right": float(np.mean(shares.argmax(axis=1) == classes)),
        "auc_carving_below_skidded": area(skid[classes == 0], skid[classes == 1]),
        "auc_skidded_below_snowplow": area(wedge[classes == 1], wedge[classes == 2]),
        "log_loss": -float(np.mean(np.log(np.maximum(shares[np.arange(len(classes)), classes], 1e-12)))),
    }


def left_out(features: Array, sigmas: Array, classes: Array, groups: Sequence[str]) -> Array:
    """Return the probabilities (n, 3) of every run by a model of the runs of all other groups."""
    shares, names = np.zeros((len(classes), len(STYLES))), np.array(groups)
    for group in dict.fromkeys(groups):
        inside = names == group
        model = train(features[~inside], classes[~inside])
        shares[inside] = [
            model.probabilities(row, sigma) for row, sigma in zip(features[inside], sigmas[inside], strict=True)
        ]
    return shares


def toml_of(model: StyleModel, runs: int) -> str:
    """Return the model as the text of ``turn_style.toml``."""
    lines = [
        f"# Made by benchmarks/turns/turn_style.py --train from {runs} telephones' runs (docs/notebook/real-runs.md).\n"
    ]
    for title, row in (("mean", model.mean), ("deviation", model.deviation)):
        lines += [f"\n[{title}]\n", *(f"{name} = {value:.6g}\n" for name, value in zip(FEATURES, row, strict=True))]
    for style, intercept, weights in zip(STYLES, model.intercept, model.weights, strict=True):
        lines += [f"\n[{style}]\nintercept = {intercept:.6g}\n"]
        lines += [f"{name} = {value:.6g}\n" for name, value in zip(FEATURES, weights, strict=True)]
    return "".join(lines)


def balances(folders: Sequence[Path], labels: pd.DataFrame) -> pd.DataFrame:
    """Return a row of features for each labelled run in the folders; what cannot be read is printed."""
    rows = []
    for name, technique in zip(labels["run"], labels["technique"], strict=True):
        pairs = [(folder / f"{name}_imu.csv", folder / f"{name}_gnss.csv") for folder in folders]
        pair = next((pair for pair in pairs if all(file.is_file() for file in pair)), None)
        if pair is None:
            print(f"{name}: no files")
            continue
        try:
            path = path_of(*pair)
        except (SssiError, ValueError) as error:
            print(f"{name}: {error}")
            continue
        values = dict(zip(FEATURES, style_features(path).tolist(), strict=True))
        rows.append({"run": name, "technique": technique, **values, "sigma": path.effective_sigma})
    return pd.DataFrame(rows)


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--labels", type=Path, required=True)
    parser.add_argument("--frozen", action="store_true", help="judge by the model that comes with the program")
    parser.add_argument("--train", type=Path, metavar="TOML", help="write a model trained on all runs")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    table = balances(options.folders, pd.read_csv(options.labels))
    known = table["technique"].map(class_of)
    judged = table[known.notna()].reset_index(drop=True)
    classes = known.dropna().to_numpy(dtype=int)
    features, sigmas = judged[list(FEATURES)].to_numpy(), judged["sigma"].to_numpy()
    if options.train:
        options.train.write_text(toml_of(train(features, classes), len(classes)), encoding="utf-8")
    result: dict[str, object] = {"mode": "frozen" if options.frozen else "leave one out"}
    if options.frozen:
        shares = np.array([style_model().probabilities(*pair) for pair in zip(features, sigmas, strict=True)])
    else:
        shares = left_out(features, sigmas, classes, judged["run"].tolist())
        days = [name.split("20", 1)[1][:8] if "20" in name else name for name in judged["run"]]
        by_day = left_out(features, sigmas, classes, days)
        result["leaving_out_days"] = figures(by_day, classes)
    friction, slowness = features[:, 0], -features[:, 2]
    result |= {
        **figures(shares, classes),
        "friction_alone_carving_below_skidded": area(friction[classes == 0], friction[classes == 1]),
        "friction_alone_skidded_below_snowplow": area(friction[classes == 1], friction[classes == 2]),
        "slowness_alone_carving_below_skidded": area(slowness[classes == 0], slowness[classes == 1]),
        "slowness_alone_skidded_below_snowplow": area(slowness[classes == 1], slowness[classes == 2]),
        "not_counted": table[known.isna()]["run"].tolist(),
    }
    listed = judged.assign(**dict(zip(STYLES, shares.T, strict=True)))
    print(listed.round(3).to_string(index=False))
    print(json.dumps(result, indent=1))
    if options.json:
        options.json.write_text(json.dumps({**result, "each": listed.to_dict("records")}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
