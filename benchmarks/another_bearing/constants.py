"""Choose the constants of the probabilities for recorded and for other specimens.

Run ``python -m benchmarks.another_bearing constants`` from the root of the repository.
It scores changes of one constant of `skarxlag.kernels.posterior` at a time, on windows of
1200 and 4800 samples and on rows of 1 s. The score of a rig is the mean log loss of the
location over lengths and over two protocols, the same bearing at other speeds and
another bearing. A setting is left out if it states more than 0.5 % of noise with at least
.9, or if less than 90 % of the rows of another bearing that it states so are right. Each
rig is left out in turn: the first table shows the score on it of what the others choose.
The second table shows what `recorded_prior` trades: same bearing against another.
"""

import sys
from unittest.mock import patch

import numpy as np
import pandas as pd

from benchmarks.another_bearing.arguments import parse
from benchmarks.another_bearing.methods import by_location
from benchmarks.another_bearing.metrics import STATED
from benchmarks.another_bearing.noise import synthetic
from benchmarks.another_bearing.protocol import SAME_BEARING, folds
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import real_rigs
from skarxlag import make_diagnoser
from skarxlag.core.fault_locations import FAULT_LOCATIONS
from skarxlag.kernels import posterior

#: Other values of each constant.
CHANGES = {
    "GAP_ODDS": (8.0, 16.0),
    "ODDS_OF_NOISE": (-1.0, 0.0, 0.5),
    "FAR_ODDS": (2.0, 8.0),
    "ANOTHER_EXPONENT": (4.0, 8.0, 12.0),
    "UNKNOWN_SHARE": (0.1, 0.3, 0.4),
}
IN_USE = {name: vars(posterior)[name] for name in CHANGES}
SETTINGS = [
    IN_USE,
    *(IN_USE | {name: value} for name, values in CHANGES.items() for value in values),
]
PRIORS = (0.1, 0.3, 0.5, 0.7, 0.9)
NOISE = "noise"
#: Samples of a window, and windows that are cut from each row of 1 s. None: the row.
_LENGTHS = (1200, 4800, None)
_WINDOWS = 2
_MOST_NOISE = 0.005
_LEAST_RIGHT = 0.9
_LEAST = 1e-6


def compared(rig):
    """Return the log residuals of all rows of a rig, and what else probabilities need."""
    parts = []
    n_samples = int(rig.sampling_rate)
    for seed, fold in enumerate(folds(rig)):
        noise = np.stack(list(synthetic(rig.sampling_rate, n_samples, seed).values()))
        sets = [
            (name, rows.X, rows.rpm, rows.location) for name, rows in fold.tests.items()
        ]
        for factor in (1.0, 1.5):
            rpm = np.full(len(noise), factor * fold.train.rpm[0])
            sets.append((NOISE, noise, rpm, np.full(len(noise), "healthy")))
        for length in _LENGTHS:
            if length is None or _WINDOWS * length <= n_samples:
                parts += _of_length(rig, fold.train, sets, length)
        print(rig.name, len(parts), file=sys.stderr, flush=True)
    return parts


def _of_length(rig, train, sets, length):
    """Yield the parts of a fold with rows of one length."""
    diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate)
    X, condition, rpm = _cut(length, train.X, train.condition, train.rpm)
    diagnoser.fit(X, condition, rpm=rpm)
    location = dict(zip(train.condition, train.location, strict=True))
    decide = diagnoser["decide"]
    for protocol, X, rpm, true in sets:
        rows, rpm, true = _cut(length, X, rpm, true)
        yield {
            "protocol": protocol,
            "residuals": diagnoser.diagnose(rows, rpm=rpm).row_evidence,
            "questions": decide.questions(),
            "noise_gaps": decide.noise_gaps_,
            "locations": np.array([location[name] for name in diagnoser.classes_]),
            "true": np.array([FAULT_LOCATIONS.index(each) for each in true]),
        }


def _cut(length, X, *labels):
    """Return the first windows of each row, and their labels."""
    if length is None:
        return X, *labels
    windows = X[:, : _WINDOWS * length].reshape(-1, length)
    return windows, *(np.repeat(label, _WINDOWS) for label in labels)


def stated(parts, setting, prior=0.5):
    """Return a row for each row of the parts: protocol, largest probability, right, log loss."""
    tables = []
    with patch.multiple(posterior, **setting):
        for part in parts:
            found = posterior.condition_log_probabilities(
                part["residuals"], *part["questions"], part["noise_gaps"], prior
            )
            probability = np.exp(found.log_probability[:, :-1])
            of_locations = by_location(probability, part["locations"])
            of_truth = of_locations[np.arange(len(of_locations)), part["true"]]
            table = {
                "protocol": part["protocol"],
                "probability": of_locations.max(axis=1),
                "right": of_locations.argmax(axis=1) == part["true"],
                "log loss": -np.log(np.maximum(of_truth, _LEAST)),
            }
            tables.append(pd.DataFrame(table))
    return pd.concat(tables, ignore_index=True)


def score(rows):
    """Return the log loss of a rig, and what it states of noise and of other bearings."""
    is_stated = rows["probability"] >= STATED
    is_noise = rows["protocol"] == NOISE
    is_same = rows["protocol"] == SAME_BEARING
    is_another = ~is_noise & ~is_same
    losses = rows[~is_noise].groupby(is_same)["log loss"].mean()
    return {
        "log loss": losses.mean(),
        "noise": is_stated[is_noise].mean(),
        "stated": (is_stated & is_another).sum(),
        "right": (is_stated & is_another & rows["right"]).sum(),
    }


def left_out(scores):
    """Return for each rig what the others choose, and its score.

    Parameters
    ----------
    scores : dict of str to DataFrame
        For each rig, a row of `score` for each of `SETTINGS`.
    """
    rows = []
    for rig, of_rig in scores.items():
        others = sum(table for name, table in scores.items() if name != rig)
        is_refused = others["noise"] > _MOST_NOISE * (len(scores) - 1)
        is_refused |= others["right"] < _LEAST_RIGHT * others["stated"]
        best = int(others["log loss"].mask(is_refused, np.inf).argmin())
        changed = {
            name.lower().replace("_", " "): value
            for name, value in SETTINGS[best].items()
        }
        losses = of_rig["log loss"]
        rows.append(
            {"left out": rig}
            | changed
            | {"log loss": losses[best], "in use": losses[0]}
        )
    return pd.DataFrame(rows)


def trade(parts):
    """Return calibration error and stated rows of both protocols for several priors."""
    table = []
    for prior in PRIORS:
        rows = stated(parts, IN_USE, prior)
        rows = rows[rows["protocol"] != NOISE]
        measures = {"recorded_prior": prior}
        for is_same, group in rows.groupby(rows["protocol"] == SAME_BEARING):
            name = "same bearing" if is_same else "another bearing"
            is_stated = group["probability"] >= STATED
            measures |= {
                f"{name}: error": expected_calibration_error(
                    group["probability"], group["right"]
                ),
                f"{name}: stated": is_stated.mean(),
                f"{name}: of these": group["right"][is_stated].mean(),
            }
        table.append(measures)
    return pd.DataFrame(table)


def main(arguments=None):
    """Run the command."""
    options = parse(arguments, __doc__, "another_bearing_constants")
    of_rigs = {
        rig.name: compared(rig) for rig in real_rigs(options.rig, options.data_home)
    }
    scores = {
        rig: pd.DataFrame([score(stated(parts, setting)) for setting in SETTINGS])
        for rig, parts in of_rigs.items()
    }
    pd.concat(scores, names=["rig", "setting"]).to_csv(options.output / "constants.csv")
    chosen = (
        f"{len(SETTINGS)} settings were scored. What all rigs but one choose, and the log loss of "
        f"the rig that is left out:\n\n{markdown(left_out(scores))}"
    )
    every = [part for parts in of_rigs.values() for part in parts]
    prior = (
        "Calibration error of the location, share of rows stated with at least .9, and how many of "
        "these are right, of all rows of the rigs. The other speeds of the same bearing share the "
        "bearing and its mounting with the training, but no recording. Another bearing shares the "
        f"rig alone:\n\n{markdown(trade(every))}"
    )
    publish(options, {"another bearing constants": f"{chosen}\n\n{prior}"})
