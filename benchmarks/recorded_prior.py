"""Price of the prior of a recorded bearing: the same bearing, another one, and noise.

A diagnoser without a bearing is fitted at the slowest setting of a rig, on the first
halves of the recordings. The prior only changes its probabilities, so all priors are
applied to the residuals of one fit. Protocols are those of `another_bearing`.
"""

import numpy as np

from benchmarks.another_bearing import folds
from benchmarks.rigs import SIX_RIGS, read_rigs
from benchmarks.tallies import tally, tally_probability
from skarxlag import make_diagnoser

PRIORS = (0.1, 0.5, 0.9, 0.97, 0.99)
#: Samples of a row, or None for a second.
LENGTHS = {"1200": 1200, "4800": 4800, "1 s": None}
NOISE = "white and brown noise"
_NOISE_ROWS = 20


def lines(home=None, rigs=(*SIX_RIGS, "Paderborn"), lengths=LENGTHS):
    """Yield the counts of each rig, length, fold, protocol and prior."""
    for rig in read_rigs(rigs, home):
        for length in lengths:
            for number, setting, train, tests in folds(rig, 1, LENGTHS[length]):
                rate = None if LENGTHS[length] else rig.sampling_rate
                fitted = _fitted(train, rate)
                facts = {"rig": rig.name, "length": length, "fold": number}
                facts["trained at"] = setting
                for protocol, rows in tests.items():
                    for prior, found in _probabilities(fitted, train, rows):
                        counts = tally_probability(*found, rows.location)
                        yield facts | {"protocol": protocol, "prior": prior} | counts
                if number < 0:
                    noise = train[np.zeros(2 * _NOISE_ROWS, dtype=int)]
                    noise = noise._replace(X=_noise(train.X.shape[-1]))
                    for prior, (probability, _) in _probabilities(fitted, train, noise):
                        counts = tally(noise.rpm, np.nan, probability.max(axis=1))
                        yield facts | {"protocol": NOISE, "prior": prior} | counts


def _names(rows):
    return [f"{c} {s}" for c, s in zip(rows.condition, rows.specimen, strict=True)]


def _fitted(train, rate):
    diagnoser = make_diagnoser(sampling_rate=rate)
    return diagnoser.fit(train.X, _names(train), rpm=train.rpm)


def _probabilities(fitted, train, rows):
    """Yield each prior, the probabilities of locations, and these locations."""
    location = dict(zip(_names(train), train.location, strict=True))
    of_class = np.array([location[name] for name in fitted.classes_])
    evidence = fitted.diagnose(rows.X, rpm=rows.rpm).row_evidence
    locations = np.unique(of_class)
    for prior in PRIORS:
        decide = fitted[-1].set_params(recorded_prior=prior)
        every = np.exp(decide.join(evidence).log_probability[:, :-1])
        columns = [every[:, of_class == name].sum(axis=1) for name in locations]
        yield prior, (np.stack(columns, axis=1), locations)


def _noise(length):
    rng = np.random.default_rng(0)
    white, brown = rng.normal(size=(2, _NOISE_ROWS, length))
    return np.concatenate([white, brown.cumsum(axis=1)])
