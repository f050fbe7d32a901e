"""Settle the constants of the diagnoser of stretches on rigs drawn at random, and confirm them.

The rule, which was written down before the first score:

1. Rigs of vibration of every family of ``random_rigs``, with recordings of four stretches of a
   second. Their nominal speeds are wrong by up to 6 % either way, at every recording by another
   share. All severities of a fault strike at the order of their place.
2. Fitted on the first halves of the recordings of one speed, scored on the second halves at every
   other speed. The score is the mean accuracy over all rigs.
3. One constant at a time is changed. Another value than the one in use is taken only if it is
   better by more than 0.01 both on the seeds that choose and on those that confirm.

A step was added after a look at these scores: what is better on both is scored once more, on
further seeds.
"""

import sys
from contextlib import nullcontext
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import pandas as pd
from sklearn.base import clone

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.recipe.random_rigs import VIBRATION, random_rig
from skarxlag import make_diagnoser
from skarxlag.commands.training import join_windows
from skarxlag.kernels import order_spectra
from skarxlag.stretches import ORDER_WEIGHT

CHOOSING, CONFIRMING, FURTHER = range(200, 204), range(300, 304), range(400, 406)
CLEAR = 0.01
#: Stretches in half a recording, their length in seconds, and the largest error of a speed.
_STRETCHES, _SECONDS, _ERROR = 2, 1.0, 0.06
#: Samples in a window of a random rig.
_WINDOW = 1200
IN_USE = "in use"


class Setting(NamedTuple):
    """Parameters of `OrderResidual` and what else differs from the values in use.

    Parameters
    ----------
    orders : dict
        Parameters of `OrderResidual`.
    exponent : float
        Of the residual of orders in the product.
    window_length : int
        Samples in a window inside the stretch.
    independent_values : int or None
        That an order spectrum is worth, beside which an unlikely factor weighs; None: as in use.
    knows_speed : bool
        Whether ``rpm`` is given when scored.
    """

    orders: tuple = ()
    exponent: float = ORDER_WEIGHT
    window_length: int = 4800
    independent_values: int | None = None
    knows_speed: bool = True


def _orders(**parameters):
    return Setting(tuple(parameters.items()))


#: What is compared, by constant and value.
SETTINGS = {
    (IN_USE, f"tolerance 0.1, exponent {ORDER_WEIGHT:g}"): Setting(),
    ("speed_tolerance", "0"): _orders(speed_tolerance=0.0),
    ("speed_tolerance", "0.03"): _orders(speed_tolerance=0.03),
    ("speed_tolerance", "0.06"): _orders(speed_tolerance=0.06),
    ("speed_tolerance", "0.2"): _orders(speed_tolerance=0.2),
    ("independent values", "10"): Setting(independent_values=10),
    ("independent values", "250"): Setting(independent_values=250),
    ("n_turns", "3"): _orders(n_turns=3.0),
    ("n_turns", "8"): _orders(n_turns=8.0),
    ("max_order", "8"): _orders(max_order=8.0),
    ("n_bands", "1"): _orders(n_bands=1),
    ("n_bands", "2"): _orders(n_bands=2),
    ("n_bands", "8"): _orders(n_bands=8),
    ("drift", "0.3"): _orders(drift=0.3),
    ("drift", "3"): _orders(drift=3.0),
    ("window_length", "1200"): Setting(window_length=1200),
    ("exponent", "0, windows alone"): Setting(exponent=0.0),
    ("exponent", "1"): Setting(exponent=1.0),
    ("exponent", "2"): Setting(exponent=2.0),
    ("no rpm, exponent", "0.25"): Setting(exponent=0.25, knows_speed=False),
    ("no rpm, exponent", "0.5 (in use)"): Setting(exponent=0.5, knows_speed=False),
    ("no rpm, exponent", "1"): Setting(exponent=1.0, knows_speed=False),
}


def stretches_of(family, seed):
    """Stretches of a random rig with wrong nominal speeds.

    Parameters
    ----------
    family : str
        Of `VIBRATION`.
    seed : int
        Draws the rig and the errors of its speeds.

    Returns
    -------
    Bunch
        A rig; ``nominal`` is the nominal speed of each stretch, ``rpm`` the true one.
    """
    # The longest stretch that a rig of this kind can have, of 51.2 kHz.
    n_windows = int(np.ceil(51_200 * _SECONDS / _WINDOW))
    rig = random_rig(family, seed, _WINDOW, _STRETCHES * n_windows, one_order_a_place=True)
    rig = join_windows(rig, int(rig.sampling_rate * _SECONDS / _WINDOW))
    keep = rig.start < 2 * _STRETCHES * rig.data.shape[-1]
    for name in ("data", "target", "rpm", "recording", "start"):
        rig[name] = rig[name][keep]
    rng = np.random.default_rng([list(VIBRATION).index(family), seed, 1])
    names, place = np.unique(rig.recording, return_inverse=True)
    rig.nominal = rig.rpm * (1 + _ERROR * rng.uniform(-1, 1, len(names)))[place]
    return rig


def accuracy(rig, settings):
    """Accuracy of each setting at speeds that were not fitted at, mean over ordered pairs.

    Parameters
    ----------
    rig : Bunch
        Of `stretches_of`.
    settings : dict
        Settings by name.

    Returns
    -------
    dict
        Accuracies by name.
    """
    first, second = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    found = {name: [] for name in settings}
    for rpm in np.unique(rig.rpm):
        train, test = first & (rig.rpm == rpm), second & (rig.rpm != rpm)
        y, truth = rig.target[train], rig.target[test]
        diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate)
        X = diagnoser["identify"].fit_transform(rig.data[train], y)
        X_test = diagnoser["identify"].transform(rig.data[test])
        for name, setting in settings.items():
            compare = clone(diagnoser["compare"]).set_params(
                window_length=setting.window_length,
                order_weight=setting.exponent,
                **{f"order_residual__{each}": value for each, value in setting.orders},
            )
            with _worth(setting.independent_values):
                compare.fit(X, y, rpm=rig.nominal[train])
                residual = compare.transform(
                    X_test, rpm=rig.nominal[test] if setting.knows_speed else None
                )
            verdict = compare.classes_[residual.argmin(axis=1)]
            by_speed = pd.Series(verdict == truth).groupby(rig.rpm[test]).mean()
            found[name].append(by_speed.mean())
    return {name: float(np.mean(each)) for name, each in found.items()}


def _worth(independent_values):
    if independent_values is None:
        return nullcontext()
    return patch.object(order_spectra, "_INDEPENDENT_VALUES", independent_values)


def battery(seeds, settings):
    """Accuracies of all rigs: a row for each, a column for each setting."""
    rows = {}
    for seed in seeds:
        for family in VIBRATION:
            rows[family, seed] = accuracy(stretches_of(family, seed), settings)
            print(f"{family} {seed}", file=sys.stderr, flush=True)
    return pd.DataFrame(rows).T.rename_axis(["family", "seed"])


def report(choosing, confirming, further=None):
    """Markdown: score in use, and what each other value gains over it.

    Parameters
    ----------
    choosing, confirming, further : DataFrame
        Of `battery`; ``further`` has the settings that are better on both of the others, and those
        that they are compared with.
    """
    rows = []
    for name in choosing:
        row = {"constant": name[0], "value": name[1]}
        for label, scores in zip(_SETS, (choosing, confirming, further), strict=True):
            is_scored = scores is not None and name in scores
            row[label] = scores[name].mean() if is_scored else np.nan
            row[f"gain, {label}"] = _gain_text(name, scores) if is_scored else ""
        rows.append(row)
    found = better(choosing, confirming)
    verdict = "No value is better than the one in use by more than 0.01 on both sets of seeds."
    if found:
        listed = "; ".join(" ".join(name) for name in found)
        verdict = f"Better than those in use by more than 0.01, choosing and confirming: {listed}."
    return f"{markdown(pd.DataFrame(rows))}\n\n{verdict}"


_SETS = ("choosing", "confirming", "further")


def better(choosing, confirming):
    """Settings that are better by more than `CLEAR` than those in use, on both sets of rigs."""
    return [
        name
        for name in choosing
        if min(_gain(name, scores).mean() for scores in (choosing, confirming)) > CLEAR
    ]


def _gain(name, scores):
    """What a setting gains over the one in use, rig by rig."""
    return scores[name] - scores[_beside(name, scores)]


def _gain_text(name, scores):
    if name == _beside(name, scores):
        return ""
    gain = _gain(name, scores)
    return f"{gain.mean():+.3f} ± {gain.std() / len(gain) ** 0.5:.3f}"


def _beside(name, scores):
    """The setting in use that another one is compared with."""
    is_unknown = name[0].startswith("no rpm")
    return next(
        each
        for each in scores
        if (each[1].endswith("(in use)") if is_unknown else each[0] == IN_USE)
    )


def _scored(path, seeds, settings):
    """Accuracies of an earlier run, or of this one."""
    if path.exists():
        print(f"{path}: results of an earlier run", file=sys.stderr)
    else:
        battery(seeds, settings).to_csv(path)
    return pd.read_csv(path, header=[0, 1], index_col=[0, 1])


def main(arguments=None):
    options = page_parser(__doc__, "stretch-constants").parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    scores = {
        name: _scored(options.output / f"{name}.csv", seeds, SETTINGS)
        for name, seeds in (("choosing", CHOOSING), ("confirming", CONFIRMING))
    }
    if found := better(**scores):
        wanted = {each for name in found for each in (name, _beside(name, SETTINGS))}
        settings = {name: setting for name, setting in SETTINGS.items() if name in wanted}
        scores["further"] = _scored(options.output / "further.csv", FURTHER, settings)
    said = ", ".join(
        f"{len(scores[name])} {name} (seeds {seeds[0]} to {seeds[-1]})"
        for name, seeds in zip(_SETS, (CHOOSING, CONFIRMING, FURTHER), strict=True)
        if name in scores
    )
    head = (
        "Accuracy over stretches of a second at "
        f"speeds that were not fitted at, mean over random rigs: {said}. Nominal speeds are wrong "
        f"by up to {_ERROR:.0%} at every recording. A gain is over the value in use, with its "
        "standard error over rigs."
    )
    publish(options, {"stretch constants": f"{head}\n\n{report(**scores)}"})
