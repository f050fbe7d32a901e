"""Choose the constants of the probabilities for recorded and for other specimens.

Run ``python -m benchmarks.another_bearing constants`` from the root of the repository.
It scores random settings of the constants of `skarxlag.kernels.posterior`. The score of
a rig is the mean log loss of the location over two protocols, the same bearing at other
speeds and another bearing, and over diagnosers with and without the bearing. The score
of a setting is the mean over rigs, plus .3 times the worst rig. A setting that states
more than 1 % of noise and sines with at least .9 is left out. Each rig is left out in
turn: the table shows the score on it of what the others choose.
"""

import sys
from unittest.mock import patch

import numpy as np
import pandas as pd

from benchmarks.another_bearing.arguments import parse
from benchmarks.another_bearing.metrics import STATED
from benchmarks.another_bearing.noise import synthetic
from benchmarks.another_bearing.protocol import BEARINGS, SAME_BEARING, folds
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.rigs import real_rigs
from skarxlag import make_diagnoser
from skarxlag.core.fault_locations import FAULT_LOCATIONS
from skarxlag.decisions.comb_probabilities import comb_evidence
from skarxlag.kernels import posterior

#: Values of each constant, of which a setting takes one at random.
GRID = {
    "GAP_ODDS": (5.0, 8.0, 12.0),
    "LEAST_FAULT_GAP": (0.2, 0.3, 0.4),
    "LEAST_LOCATION_GAP": (0.2, 0.3, 0.4),
    "FAR_ODDS": (4.0, 8.0, 12.0),
    "FAR": (1.3, 1.6, 2.0),
    "LOCATION_EXPONENT": (2.0, 3.0, 4.0, 6.0, 8.0),
    "FAULT_EXPONENT": (4.0, 6.0, 8.0, 12.0),
    "UNKNOWN_SHARE": (0.1, 0.15, 0.2, 0.25),
    "UNKNOWN_ODDS": (3.0, 6.0),
    "UNLIKE": (2.5, 3.2),
}
IN_USE = {name: vars(posterior)[name] for name in GRID}
_N_SETTINGS = 240
_WORST = 0.3
_MOST_NOISE = 0.01
_LEAST = 1e-6


def compared(rig):
    """Return what the probabilities are computed from, for all folds of a rig."""
    parts = []
    n_samples = int(rig.sampling_rate)
    for seed, fold in enumerate(folds(rig)):
        train = fold.train
        bearing = BEARINGS[rig.name]
        diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate, bearing=bearing)
        diagnoser.fit(train.X, train.condition, rpm=train.rpm)
        noise = np.stack(list(synthetic(rig.sampling_rate, n_samples, seed).values()))
        sets = [
            (name, rows.X, rows.rpm, rows.location) for name, rows in fold.tests.items()
        ]
        for factor in (1.0, 1.5):
            rpm = np.full(len(noise), factor * train.rpm[0])
            sets.append(("noise", noise, rpm, np.full(len(noise), "healthy")))
        for protocol, X, rpm, location in sets:
            parts.append(_compared(diagnoser, protocol, X, rpm, location))
        print(rig.name, len(parts), file=sys.stderr, flush=True)
    return parts


def _compared(diagnoser, protocol, X, rpm, location):
    decide = diagnoser["decide"]
    learned = decide.conditions_
    innovations = diagnoser["identify"].transform(X)
    levels = learned.residual_.transform(innovations, rpm=rpm)
    combs = decide.match(innovations, rpm=rpm)
    has_healthy = len(decide.healthy_scores_) > 0
    scores = combs.scores - (decide.reference_ if has_healthy else 0.8)
    locations = np.append(decide.class_locations_, FAULT_LOCATIONS.index("healthy"))
    return {
        "protocol": protocol,
        "levels": np.log(levels),
        "drift": learned._drift(rpm, innovations),
        "questions": learned.questions(),
        "noise_gaps": tuple(learned.noise_gaps_),
        "class_locations": decide.class_locations_,
        "by_combs": comb_evidence(scores, locations),
        "true": np.array([FAULT_LOCATIONS.index(each) for each in location]),
    }


def losses(parts, setting):
    """Return the score of a rig with a setting, and the share of noise that is stated."""
    by_protocol = {}
    noise = []
    with patch.multiple(posterior, **setting):
        for part in parts:
            options = {"location_exponent": setting["LOCATION_EXPONENT"]}
            spectra = posterior.condition_log_probabilities(
                part["levels"],
                *part["questions"],
                part["drift"],
                part["noise_gaps"],
                **options,
            ).log_probability
            if part["protocol"] == "noise":
                noise.append(_of_locations(np.exp(spectra), part).max(axis=1) >= STATED)
                continue
            joint = spectra + part["by_combs"]
            for logs in (spectra, joint):
                probability = np.exp(
                    logs - np.logaddexp.reduce(logs, axis=1, keepdims=True)
                )
                every = _of_locations(probability, part)
                of_truth = every[np.arange(len(every)), part["true"]]
                is_same = part["protocol"] == SAME_BEARING
                by_protocol.setdefault(is_same, []).append(
                    -np.log(np.maximum(of_truth, _LEAST)).mean()
                )
    return float(
        np.mean([np.mean(each) for each in by_protocol.values()])
    ), np.concatenate(noise)


def _of_locations(probability, part):
    """Probabilities of the locations; that of an unknown condition is left out."""
    locations = [
        probability[:, :-1][:, part["class_locations"] == p]
        for p in range(len(FAULT_LOCATIONS))
    ]
    return np.stack([each.sum(axis=1) for each in locations], axis=1)


def settings():
    """Return the constants in use, and random settings of the grid."""
    rng = np.random.default_rng(0)
    drawn = [
        {name: float(rng.choice(values)) for name, values in GRID.items()}
        for _ in range(_N_SETTINGS - 1)
    ]
    return [IN_USE, *drawn]


def left_out(scores, noise):
    """Return for each rig what the others choose, and its score.

    Parameters
    ----------
    scores, noise : DataFrame of shape (n_settings, n_rigs)
        Scores, and shares of noise that are stated.
    """
    grid = settings()
    rows = []
    for rig in scores:
        others = scores.drop(columns=rig)
        total = others.mean(axis=1) + _WORST * others.max(axis=1)
        total[noise.drop(columns=rig).max(axis=1) > _MOST_NOISE] = np.inf
        best = int(total.argmin())
        rows.append(
            {"left out": rig}
            | {
                name.lower().replace("_", " "): value
                for name, value in grid[best].items()
            }
            | {"log loss": scores.loc[best, rig], "in use": scores.loc[0, rig]}
        )
    return pd.DataFrame(rows)


def main(arguments=None):
    """Run the command."""
    options = parse(arguments, __doc__, "another_bearing_constants")
    scores = {}
    noise = {}
    for rig in real_rigs(options.rig, options.data_home):
        parts = compared(rig)
        results = [losses(parts, setting) for setting in settings()]
        scores[rig.name] = [loss for loss, _ in results]
        noise[rig.name] = [stated.mean() for _, stated in results]
    scores = pd.DataFrame(scores)
    noise = pd.DataFrame(noise)
    scores.join(noise, rsuffix=" noise").to_csv(
        options.output / "constants.csv", index=False
    )
    table = left_out(scores, noise)
    note = f"{_N_SETTINGS} settings were scored. What all rigs but one choose, and its log loss:"
    publish(options, {"another bearing constants": f"{note}\n\n{markdown(table)}"})
