"""Spectra, combs, and both: verdicts at another speed or load, after remounting, on another rig.

Run ``python -m benchmarks.fault_orders joint`` from the root of the repository.

`make_diagnoser` learns the conditions of a rig at one speed (MFPT: at one load), from
the first halves of the recordings. Rows of 1 s are then named under four protocols:

- other speed: the second halves of the recordings at all other speeds or loads.
- remounted mildly, remounted strongly: the second halves at all speeds, through a
  random smooth filter, with noise. No rig has recordings of two mountings.
- other rig: another rig with the same conditions. Its bearing is known.
"""

import sys
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import fft
from scipy.signal import oaconvolve

from benchmarks.fault_orders.rigs import RIGS, recordings
from benchmarks.pages.blocks import markdown, page_parser, publish
from skarxlag import FaultOrderClassifier, make_diagnoser
from skarxlag.core.fault_locations import FAULT_LOCATIONS
from skarxlag.decisions.comb_limits import WITHOUT_COMB
from skarxlag.decisions.comb_probabilities import ODDS, VISIBLE, comb_evidence

#: Log odds for each neper, and probability of a visible comb.
SETTINGS = list(product([3.0, 5.0, 8.0, 12.0], [0.05, 0.1, 0.2, 0.4]))
IN_USE = SETTINGS.index((ODDS, VISIBLE))
#: Size of the log gain in nepers, level of the noise, and seeds of the filters.
_MOUNTINGS = {
    "remounted mildly": (0.5, 0.2, (10, 11)),
    "remounted strongly": (1.0, 0.3, (0, 1, 2)),
}
_SAME_CONDITIONS = [
    ("SpectraQuest", "self-built"),
    ("CWRU drive end", "CWRU fan end"),
]
_TAPS = 257
_COSINES = 40


class Rows(NamedTuple):
    """Rows of a rig with their condition, location, speed and campaign; some are learned."""

    X: np.ndarray
    y: np.ndarray
    location: np.ndarray
    rpm: np.ndarray
    campaign: np.ndarray
    is_first_half: np.ndarray

    def __getitem__(self, rows):
        return Rows(*(each[rows] for each in self._asdict().values()))


class Scored(NamedTuple):
    """Rows after the comparison: by spectra, scores of combs, and the truth."""

    log_probability: np.ndarray
    scores: np.ndarray
    by_combs: np.ndarray
    class_locations: np.ndarray
    truth: np.ndarray
    true_location: np.ndarray


def rows_of(rig):
    """Return the rows of 1 s of all recordings.

    A campaign is a speed, or a load if all speeds are the same.
    """
    parts = []
    one_speed = len({recording.rpm for recording in rig}) == 1
    for recording in rig:
        X = recording.samples.reshape(-1, int(recording.rate))
        campaign = recording.name.split("_")[-1] if one_speed else f"{recording.rpm:g}"
        labels = (recording.condition, recording.location, recording.rpm, campaign)
        first = np.arange(len(X)) < len(X) // 2
        parts.append((X, *(np.repeat(label, len(X)) for label in labels), first))
    return Rows(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def remounted(X, size, noise, seed):
    """Rows through a random smooth filter of minimum phase, scaled to unit power, with noise."""
    rng = np.random.default_rng(seed)
    n_fft = 4096
    cosine = np.arange(1, _COSINES + 1)
    weights = size * rng.normal(size=_COSINES) / np.sqrt(cosine)
    log_gain = weights @ np.cos(
        np.pi * np.outer(cosine, np.linspace(0, 1, n_fft // 2 + 1))
    )
    cepstrum = fft.irfft(log_gain, n_fft)
    cepstrum[1 : n_fft // 2] *= 2
    cepstrum[n_fft // 2 + 1 :] = 0
    taps = fft.irfft(np.exp(fft.rfft(cepstrum)), n_fft)[:_TAPS]
    filtered = oaconvolve(X, taps[np.newaxis], axes=1)[:, : X.shape[1]]
    return filtered / filtered.std(axis=1, keepdims=True) + noise * rng.normal(
        size=X.shape
    )


def scored(name, rigs):
    """Compare rows of a rig under all protocols, for each campaign that is learned.

    Parameters
    ----------
    name : str
        The rig.
    rigs : dict of str to list of Recording
        All rigs.

    Yields
    ------
    (str, Scored)
        Protocol, and the rows.
    """
    rate = rigs[name][0].rate
    bearing = rigs[name][0].bearing
    rows = rows_of(rigs[name])
    others = [pair[1 - pair.index(name)] for pair in _SAME_CONDITIONS if name in pair]
    for campaign in np.unique(rows.campaign):
        learned = rows[rows.is_first_half & (rows.campaign == campaign)]
        diagnoser = make_diagnoser(sampling_rate=rate, bearing=bearing)
        diagnoser.fit(learned.X, learned.y, rpm=learned.rpm)
        late = rows[~rows.is_first_half]
        yield (
            "other speed",
            compare(diagnoser, late[late.campaign != campaign], bearing),
        )
        for protocol, (size, noise, seeds) in _MOUNTINGS.items():
            for seed in seeds:
                moved = late._replace(X=remounted(late.X, size, noise, seed))
                yield protocol, compare(diagnoser, moved, bearing)
        for other in (each for each in others if each in rigs):
            tested = rows_of(rigs[other])[::2]
            yield "other rig", compare(diagnoser, tested, rigs[other][0].bearing)


def compare(diagnoser, rows, bearing):
    """Compare rows with a fitted diagnoser; their bearing may be another one."""
    combs = diagnoser["decide"]
    innovations = diagnoser["identify"].transform(rows.X)
    learned = combs.conditions_.diagnose(innovations, rpm=rows.rpm)
    matcher = FaultOrderClassifier(bearing=bearing, sampling_rate=combs.sampling_rate)
    scores = matcher.fit(innovations[:1]).match(innovations, rpm=rows.rpm)
    classes = combs.classes_
    without = combs.reference_ if len(combs.healthy_scores_) > 0 else WITHOUT_COMB
    named = np.searchsorted(classes, combs._judge(scores).verdict)
    true_class = np.searchsorted(classes, rows.y).clip(max=len(classes) - 1)
    return Scored(
        log_probability=learned.log_probability,
        scores=scores.scores - without,
        by_combs=combs.class_locations_[named],
        class_locations=combs.class_locations_,
        truth=np.where(classes[true_class] == rows.y, true_class, -1),
        true_location=np.array(
            [FAULT_LOCATIONS.index(location) for location in rows.location]
        ),
    )


def accuracies(part, setting):
    """Return the shares of right conditions and locations by spectra, combs and both."""
    evidence = comb_evidence(part.scores, part.class_locations, *setting)
    # An unknown condition is no answer here.
    spectra = part.log_probability[:, :-1]
    both = (spectra + evidence).argmax(axis=1)
    nearest = spectra.argmax(axis=1)
    return {
        "condition, spectra": np.mean(nearest == part.truth),
        "condition, both": np.mean(both == part.truth),
        "location, spectra": np.mean(
            part.class_locations[nearest] == part.true_location
        ),
        "location, combs": np.mean(part.by_combs == part.true_location),
        "location, both": np.mean(part.class_locations[both] == part.true_location),
    }


def table(parts, setting=SETTINGS[IN_USE]):
    """Return the accuracies by protocol and rig, mean over the campaigns that were learned."""
    rows = [
        {"protocol": protocol, "rig": rig, **accuracies(part, setting)}
        for rig, protocol, part in parts
    ]
    return pd.DataFrame(rows).groupby(["protocol", "rig"], sort=False).mean()


def settings_left_out(parts):
    """Return the share of right locations of each rig, with the settings best on the others."""
    location = pd.DataFrame(
        [table(parts, setting)["location, both"] for setting in SETTINGS]
    )
    by_rig = location.T.groupby("rig", sort=False).mean().T.reset_index(drop=True)
    rows = []
    for rig in by_rig:
        best = int(by_rig.drop(columns=rig).mean(axis=1).argmax())
        odds, visible = SETTINGS[best]
        row = {"rig left out": rig, "odds": odds, "visible": visible}
        row |= {
            "location": by_rig.loc[best, rig],
            "location, in use": by_rig.loc[IN_USE, rig],
        }
        rows.append(row)
    return pd.DataFrame(rows)


def main(arguments=None):
    parser = page_parser(__doc__, "fault_orders_joint")
    parser.add_argument("--rig", nargs="+", choices=list(RIGS), default=list(RIGS))
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    rigs = {name: recordings(name, options.data_home) for name in options.rig}
    parts = []
    for name in rigs:
        parts += [(name, protocol, part) for protocol, part in scored(name, rigs)]
        print(name, file=sys.stderr, flush=True)
    accuracies_by_rig = table(parts).reindex(
        ["other speed", *_MOUNTINGS, "other rig"], level="protocol"
    )
    accuracies_by_rig.to_csv(options.output / "joint.csv")
    blocks = {
        "fault orders joint": "Rows of 1 s, nominal speed; share of right conditions and of right "
        "locations, mean over the speeds or loads that were learned.\n\n"
        + markdown(accuracies_by_rig.reset_index()),
    }
    if len(rigs) > 1:
        chosen = settings_left_out(parts)
        blocks["fault orders joint settings"] = (
            f"{len(SETTINGS)} settings were scored. For each rig, those that are best on the mean "
            "of all other rigs: log odds of a neper, probability of a visible comb."
            f"\n\n{markdown(chosen)}"
        )
    publish(options, blocks)
