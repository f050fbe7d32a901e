"""Choose the constants of make_diagnoser on all rigs, leaving one rig out in turn.

Run ``python -m benchmarks.recipe constants`` from the root of the repository; the
folder of the rigs is ``$SKARXLAG_DATA``. Every setting is fitted on first halves of
recordings and scored on second halves, at speeds that were not fitted at. The rule:

1. A cell is one kind of rows and one protocol (one training speed, or all but one). Its score over
   rigs is the mean of the worst rig and the mean rig; a setting's score is the mean
   over cells.
2. Settings within 0.005 of the best tie. The one of the highest mean over rigs and cells is chosen.
3. The exponent of residuals in probabilities is, for each protocol, the one whose largest expected
   calibration error over rigs and kinds of rows is the least.

Only real rigs choose. Each is left out in turn: what the others choose is scored on it.
The simulated rigs are reported. ``--wide`` scores a second grid, which was added when
the first had its best smooth drift and model order at its edges.
"""

import os
from functools import cache, partial
from itertools import product

import numpy as np
import pandas as pd
from scipy.special import log_softmax

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.pages.kept import kept_or_computed
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import real_rigs, simulated_rigs
from benchmarks.recipe.targets import ROWS, folds, rows_of
from skarxlag import (
    ARXLaguerre,
    LogSpectra,
    OrderResidual,
    SpectralDistance,
    StretchResidual,
)

PROTOCOLS = ("one speed", "others")
ORDER_WEIGHTS = (0.0, 0.25, 0.5, 0.75, 1.0)
EXPONENTS = (8, 12, 16, 20, 24, 28, 32, 40, 50, 64)
#: Model orders, spectrum orders and smooth drifts of each grid.
GRIDS = {
    "constants": ((1, 4, 32), (64, 128, 256), (0.15, 0.3, 0.6)),
    "constants wide": ((1,), (128,), (0.05, 0.1, 0.2, 0.4, 0.8, 1.2)),
}
TIE = 0.005
#: Order of the model for measured inputs, which the real rigs do not have.
INPUT_ORDER = 32
#: Samples of the windows that a row is cut into.
WINDOW = StretchResidual().window_length
#: Parameters of a setting, in the order of the columns of the tables.
NAMES = [
    "model order",
    "spectrum order",
    "smooth drift",
    "order weight",
]


class Fold:
    """Log spectra and order residuals of one training set and its test rows, for one model order.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it.
    length : int
        Samples of a row.
    trained, tested : list of float
        Speeds.
    order, spectrum_order : int
        Of the model, and of the autoregressive spectra of windows.
    """

    def __init__(self, rig, length, trained, tested, order, spectrum_order):
        (X, self.y, self.rpm), (X_test, self.y_test, self.rpm_test) = (
            rows_of(rig, length, half, speeds)
            for half, speeds in enumerate((trained, tested))
        )
        model = ARXLaguerre(order=(order, INPUT_ORDER), bank=False).fit(X, self.y)
        train = model.transform(X)
        test = model.transform(X_test)
        spectra = LogSpectra(spectrum_order=spectrum_order)
        self.train = spectra.fit_transform(_windows(train)).astype(np.float32)
        self.test = spectra.transform(_windows(test)).astype(np.float32)
        self.classes = np.unique(self.y)
        self.of_orders = np.zeros((len(test), len(self.classes)))
        if length > 4800 and train.shape[1] == 1:
            orders = OrderResidual(sampling_rate=rig.sampling_rate)
            orders.fit(train, self.y, rpm=self.rpm)
            self.of_orders = np.log(orders.transform(test, rpm=self.rpm_test))

    def log_residuals(self, smooth):
        """Logarithms of the residuals of the windows, their mean over each row."""
        n = len(self.train) // len(self.y)
        n_test = len(self.test) // len(self.y_test)
        distance = SpectralDistance(smooth_drift=smooth)
        distance.fit(self.train, np.repeat(self.y, n), rpm=np.repeat(self.rpm, n))
        residuals = distance.transform(self.test, rpm=np.repeat(self.rpm_test, n_test))
        return np.log(residuals).reshape(len(self.y_test), n_test, -1).mean(axis=1)

    def verdicts(self, log_residuals, order_weight):
        """Log residuals with those of the orders, and which rows are right."""
        residuals = log_residuals + order_weight * self.of_orders
        return residuals, self.classes[residuals.argmin(axis=1)] == self.y_test


def _windows(rows):
    """Cut innovations of rows into windows, as StretchResidual does by default."""
    n_rows, n_models, n_samples = rows.shape
    length = min(WINDOW, n_samples)
    n = n_samples // length
    cut = rows[..., : n * length].reshape(n_rows, n_models, n, length)
    return cut.swapaxes(1, 2).reshape(-1, n_models, length)


def score_rig(rig, kinds, grid, report=print):
    """Score all settings of a grid on a rig.

    Returns
    -------
    accuracies : list of dict
        Setting, cell and accuracy, mean over pairs of speeds.
    calibrations : list of dict
        Setting, cell, exponent and calibration error.
    """
    accuracies = []
    calibrations = []
    orders, spectrum_orders, drifts = grid
    for kind, order, spectrum_order in product(kinds, orders, spectrum_orders):
        length = ROWS[kind] or int(rig.sampling_rate)
        every = [
            (name, Fold(rig, length, a, b, order, spectrum_order))
            for name, a, b in folds(rig)
        ]
        weights = ORDER_WEIGHTS if ROWS[kind] is None else ORDER_WEIGHTS[:1]
        for smooth in drifts:
            residuals = [
                (name, fold, fold.log_residuals(smooth)) for name, fold in every
            ]
            for weight in weights:
                # Windows have no orders: their scores count for every weight.
                same = [weight] if len(weights) > 1 else ORDER_WEIGHTS
                for protocol in PROTOCOLS:
                    results = [
                        (fold, *fold.verdicts(each, weight))
                        for name, fold, each in residuals
                        if name == protocol
                    ]
                    right = np.mean(
                        [
                            np.mean(ok[fold.rpm_test == speed])
                            for fold, _, ok in results
                            for speed in np.unique(fold.rpm_test)
                        ]
                    )
                    errors = {
                        each: _calibration_error(results, each) for each in EXPONENTS
                    }
                    for each in same:
                        values = (order, spectrum_order, smooth, each)
                        setting = dict(zip(NAMES, values, strict=True))
                        cell = {"rig": rig.name, "rows": kind, "trained at": protocol}
                        accuracies.append(setting | cell | {"right": right})
                        calibrations += [
                            setting | cell | {"exponent": exponent, "error": error}
                            for exponent, error in errors.items()
                        ]
        report(f"{rig.name}, {kind}, order {order}, spectrum order {spectrum_order}")
    return accuracies, calibrations


def _score_frames(rig, kinds, grid):
    scores = zip(("accuracy", "calibration"), score_rig(rig, kinds, grid), strict=True)
    return {what: pd.DataFrame(rows) for what, rows in scores}


def _calibration_error(verdicts, exponent):
    stated = [
        np.exp(log_softmax(-exponent * logs, axis=1).max(axis=1))
        for _, logs, _ in verdicts
    ]
    return expected_calibration_error(
        np.concatenate(stated), np.concatenate([right for _, _, right in verdicts])
    )


def choose(accuracies):
    """The setting that rules 1 and 2 choose, and the scores of all.

    Parameters
    ----------
    accuracies : DataFrame
        Columns `NAMES`, rig, rows, trained at, and right.

    Returns
    -------
    setting : tuple
        In the order of `NAMES`.
    scores : DataFrame
        Columns score and mean, indexed by setting.

    Examples
    --------
    >>> rows = [(4, 128, 0.1, 0.5, "a", 0.7), (4, 128, 0.1, 0.5, "b", 1.0),
    ...         (8, 128, 0.1, 0.5, "a", 0.5), (8, 128, 0.1, 0.5, "b", 1.0)]
    >>> frame = pd.DataFrame(rows, columns=[*NAMES, "rig", "right"])
    >>> setting, _ = choose(frame.assign(**{"rows": "w", "trained at": "one speed"}))
    >>> [float(value) for value in setting]
    [4.0, 128.0, 0.1, 0.5]
    """
    cells = accuracies.groupby([*NAMES, "rows", "trained at"])["right"].agg(
        ["min", "mean"]
    )
    scores = pd.DataFrame(
        {"score": (cells["min"] + cells["mean"]) / 2, "mean": cells["mean"]}
    )
    scores = scores.groupby(level=NAMES).mean()
    tied = scores[scores["score"] >= scores["score"].max() - TIE]
    return tied["mean"].idxmax(), scores


def choose_exponents(calibrations, setting):
    """The exponent that rule 3 chooses for each protocol, and its largest error."""
    worst = (
        _of(calibrations, setting).groupby(["trained at", "exponent"])["error"].max()
    )
    return {
        protocol: (worst[protocol].idxmin(), worst[protocol].min())
        for protocol in PROTOCOLS
    }


def _of(frame, setting):
    return frame[
        np.all([frame[n] == v for n, v in zip(NAMES, setting, strict=True)], axis=0)
    ]


def left_out_table(of_real, errors, real):
    """Table of the setting that the other rigs choose, and its scores on the left-out rig."""
    rows = []
    for rig in real:
        others, _ = choose(of_real[of_real.rig != rig])
        exponents = choose_exponents(errors[errors.rig != rig], others)
        cells = _of(of_real[of_real.rig == rig], others).set_index(
            ["rows", "trained at"]
        )["right"]
        row = {"left out": rig} | dict(zip(NAMES, others, strict=True))
        row |= {
            f"{kind}, {protocol}": value for (kind, protocol), value in cells.items()
        }
        here = _of(errors[errors.rig == rig], others)
        for protocol, (exponent, _) in exponents.items():
            is_used = (here["trained at"] == protocol) & (here.exponent == exponent)
            row[f"exponent, {protocol}"] = exponent
            row[f"largest error, {protocol}"] = here.loc[is_used, "error"].max()
        rows.append(row)
    table = pd.DataFrame(rows)
    is_score = [", " in name and "exponent" not in name for name in table]
    means = table.loc[:, is_score].mean()
    # The row of the means leaves the settings empty. As text they stay whole numbers.
    settings = table.columns[~np.array(is_score)].drop("left out")
    table[settings] = table[settings].map("{:g}".format)
    return pd.concat([table, pd.DataFrame([{"left out": "mean"} | means.to_dict()])])


def report(accuracies, calibrations, real):
    """Format the choice, the scores of each left-out rig and the calibration errors."""
    of_real = accuracies[accuracies.rig.isin(real)]
    errors = calibrations[calibrations.rig.isin(real)]
    setting, scores = choose(of_real)
    exponents = "; ".join(
        f"exponent {exponent:g} with {protocol} to train on (largest calibration error {error:.3f})"
        for protocol, (exponent, error) in choose_exponents(errors, setting).items()
    )
    best = scores.sort_values("score", ascending=False).head(12).reset_index()
    chosen = _of(accuracies, setting).pivot_table(
        index=["rows", "trained at"], columns="rig", values="right", sort=False
    )
    listed = ", ".join(f"{n} {v:g}" for n, v in zip(NAMES, setting, strict=True))
    return "\n\n".join(
        [
            f"{len(scores)} settings were scored, and {len(EXPONENTS)} exponents. Chosen: "
            f"**{listed}**; {exponents}. First halves of the recordings train, second halves test: "
            "they share the specimen and its mounting, and differ in speed.",
            "Choice without each rig, and its score on that rig:",
            markdown(left_out_table(of_real, errors, real)),
            "The chosen setting on every rig:",
            markdown(chosen.reset_index()),
            "The best settings on all real rigs:",
            markdown(best, digits=4),
        ]
    )


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "constants")
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    parser.add_argument("--wide", action="store_true", help="score the second grid")
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    name = "constants wide" if options.wide else "constants"
    frames = []
    sources = [(rig, list(ROWS)) for rig in real_rigs(home=options.data_home)]
    real = [rig.name for rig, _ in sources]
    sources += [
        (rig, [k for k in ROWS if ROWS[k] is not None]) for rig in simulated_rigs()
    ]
    for rig, kinds in sources:
        scores = cache(partial(_score_frames, rig, kinds, GRIDS[name]))
        frames.append(
            [
                kept_or_computed(
                    options.output / f"{name} {rig.name} {what}.csv",
                    name.replace(" ", "-"),
                    lambda scores=scores, what=what: scores()[what],
                )
                for what in ("accuracy", "calibration")
            ]
        )
    accuracies, calibrations = (pd.concat(each) for each in zip(*frames, strict=True))
    publish(options, {name: report(accuracies, calibrations, real)})


if __name__ == "__main__":
    main()
