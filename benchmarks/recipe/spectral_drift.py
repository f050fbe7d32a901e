"""What a change of speed does to spectra and models, against what tells conditions apart."""

from functools import partial

import numpy as np
import pandas as pd
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from benchmarks.cross_speed.peers import LabelsOnly, log_spectrum, unit_rms
from benchmarks.cross_speed.protocol import first_and_second_half, leave_one_speed_in
from skarxlag import ARXLaguerre, PIObserver, ThresholdLadder
from skarxlag.kernels.drift import smooth_variance
from skarxlag.kernels.spectra import autoregressive_log_spectrum, cepstrum

QUARTERS = ["valleys", "below the median", "above the median", "peaks"]
QUEFRENCIES = [(1, 1), (2, 2), (3, 4), (5, 8), (9, 16), (17, 32), (33, 48)]
POLES = (0.0, 0.3, 0.6, "optimise")


def moments(rows, target, rpm):
    """Means of each condition and speed, and the scatter of windows about them.

    Parameters
    ----------
    rows : array of shape (n_windows, n_features)
    target, rpm : arrays of shape (n_windows,)

    Returns
    -------
    means : array of shape (n_conditions, n_speeds, n_features)
    within : array of shape (n_features,)
        Variance about the means, pooled.
    noise : array of shape (n_features,)
        Mean variance of one of the means, were windows independent.
    """
    cells = [
        [rows[(target == c) & (rpm == speed)] for speed in np.unique(rpm)]
        for c in np.unique(target)
    ]
    means = np.array([[cell.mean(axis=0) for cell in row] for row in cells])
    variances = np.array([[cell.var(axis=0, ddof=1) for cell in row] for row in cells])
    counts = np.array([[len(cell) for cell in row] for row in cells])[..., np.newaxis]
    within = (variances * counts).sum(axis=(0, 1)) / counts.sum()
    return means, within, (variances / counts).mean(axis=(0, 1))


def mean_square_move(means, noise):
    """Mean square change of a condition from one speed to another, and the part all share.

    Parameters
    ----------
    means : array of shape (n_conditions, n_speeds, n_features)
    noise : array of shape (n_features,)
        Variance of a mean, which is taken out.

    Returns
    -------
    own, shared : arrays of shape (n_features,)
        Mean square over conditions and pairs of speeds; mean square of the mean over conditions.

    Examples
    --------
    >>> means = np.array([[[0.0], [2.0]], [[5.0], [5.0]]])
    >>> mean_square_move(means, np.zeros(1))
    (array([2.]), array([1.]))
    """
    i, j = np.triu_indices(means.shape[1], 1)
    moves = means[:, i] - means[:, j]
    own = np.mean(moves**2, axis=(0, 1)) - 2 * noise
    shared = np.mean(moves.mean(axis=0) ** 2, axis=0) - 2 * noise / len(means)
    return np.maximum(own, 0), np.maximum(shared, 0)


def mean_square_distance(means):
    """Mean square difference between two conditions at one speed, of each feature."""
    i, j = np.triu_indices(len(means), 1)
    return np.mean((means[i] - means[j]) ** 2, axis=(0, 1))


class LevelQuarter(TransformerMixin, BaseEstimator):
    """Keep a quarter of the columns: those of lowest (0) to highest (3) training mean.

    Parameters
    ----------
    quarter : int
    """

    def __init__(self, quarter):
        self.quarter = quarter

    def fit(self, X, y=None):
        """Order the columns by their means."""
        self.columns_ = np.array_split(np.argsort(np.mean(X, axis=0)), len(QUARTERS))[self.quarter]
        return self

    def transform(self, X):
        """The columns that are kept."""
        return X[:, self.columns_]


def quarter_lda(quarter, of=log_spectrum):
    """Linear discriminant analysis on a quarter of the spectrum; None: on all of it."""
    steps = [] if quarter is None else [LevelQuarter(quarter)]
    return make_pipeline(
        FunctionTransformer(unit_rms),
        FunctionTransformer(of),
        *steps,
        LinearDiscriminantAnalysis(),
    )


def spectrum(X):
    """Power spectrum of which `log_spectrum` is the logarithm."""
    return np.exp(log_spectrum(X))


def accuracy(make_classifier, rig, window_length):
    """Same-speed mean, cross-speed mean and worst pair of single windows."""

    def verdicts_only():
        return LabelsOnly(make_classifier())  # probabilities would cost every transform again

    pairs = [
        (pair["train_rpm"] == pair["test_rpm"], pair["window"]["accuracy"])
        for pair in leave_one_speed_in(verdicts_only, rig, window_length)
    ]
    cross = [value for same, value in pairs if not same]
    return {
        "same speed": np.mean([value for same, value in pairs if same]),
        "other speeds": np.mean(cross),
        "worst pair": np.min(cross),
    }


def valley_table(rig, window_length):
    """Where in the spectrum, by level, conditions differ and speed matters."""
    X = log_spectrum(unit_rms(rig.data))
    means, within, noise = moments(X, rig.target, rig.rpm)
    own, _ = mean_square_move(means, noise)
    distance = mean_square_distance(means)
    level = means.mean(axis=(0, 1))
    rows = []
    for quarter, columns in enumerate(np.array_split(np.argsort(level), len(QUARTERS))):
        rows.append(
            {
                "log power of": QUARTERS[quarter],
                "share of power": np.exp(X[:, columns]).sum() / np.exp(X).sum(),
                "between conditions": distance[columns].mean(),
                "between speeds": own[columns].mean(),
                "ratio": distance[columns].mean() / own[columns].mean(),
                "windows": 2 * within[columns].mean(),
                **accuracy(partial(quarter_lda, quarter), rig, window_length),
            }
        )
    for name, of in (("all, log power", log_spectrum), ("all, power", spectrum)):
        scores = accuracy(partial(quarter_lda, None, of), rig, window_length)
        rows.append({"log power of": name, "share of power": 1.0, **scores})
    return pd.DataFrame(rows)


def drift_table(rig, window_length):
    """Moves of the cepstra from speed to speed, against distances and scatter, by quefrency."""
    log_spectra = autoregressive_log_spectrum(unit_rms(rig.data), 128, 256)
    cepstra = cepstrum(log_spectra)[:, : QUEFRENCIES[-1][1]]
    means, within, noise = moments(cepstra, rig.target, rig.rpm)
    own, shared = mean_square_move(means, noise)
    distance = mean_square_distance(means)
    prior = smooth_variance(cepstra.shape[1], smooth=0.1, rough=0.01)
    exponent, constant = drift_exponent(own)
    rows = []
    for low, high in QUEFRENCIES:
        n = slice(low - 1, high)
        rows.append(
            {
                "n": f"{low}" if low == high else f"{low} to {high}",
                "between speeds": own[n].mean(),
                "prior c/n² + f": prior[n].mean(),
                "shared by all conditions": shared[n].sum() / own[n].sum(),
                "windows": within[n].mean(),
                "between conditions": distance[n].mean(),
                "fit": np.mean(constant * np.arange(low, high + 1.0) ** exponent),
            }
        )
    table = pd.DataFrame(rows)
    return table.rename(columns={"fit": f"fit {constant:.2f} n^{exponent:.2f}"})


def drift_exponent(moves):
    """Exponent and constant of a power law through mean square moves, n = 1, 2, ...

    A straight line through the logarithms of the band means, so that noise at large n does not
    outnumber the rest.

    Examples
    --------
    >>> exponent, constant = drift_exponent(0.5 / np.arange(1.0, 49.0) ** 2)
    >>> round(exponent, 1), round(constant, 1)
    (-2.0, 0.5)
    """
    n = np.array([np.sqrt(low * high) for low, high in QUEFRENCIES])
    level = np.array([moves[low - 1 : high].mean() for low, high in QUEFRENCIES])
    seen = level > 0
    exponent, log_constant = np.polyfit(np.log(n[seen]), np.log(level[seen]), 1)
    return float(exponent), float(np.exp(log_constant))


def best_poles(rig, window_length):
    """Pole of least prediction error at each speed, and what it gains over poles 0 and 0.3."""
    first, _ = first_and_second_half(rig.recording, rig.start, window_length)
    rows = []
    for order in (8, 32):
        for speed in np.unique(rig.rpm):
            train = first & (rig.rpm == speed)
            models = {
                pole: ARXLaguerre(order=order, pole=pole).fit(rig.data[train], rig.target[train])
                for pole in ("optimise", 0.0, 0.3)
            }
            error = {pole: np.mean(model.noise_level_**2) for pole, model in models.items()}
            rows.append(
                {
                    "order": order,
                    "rpm": f"{speed:g}",
                    "best pole": models["optimise"].poles_[0],
                    "dB below pole 0": 10 * np.log10(error[0.0] / error["optimise"]),
                    "dB below pole 0.3": 10 * np.log10(error[0.3] / error["optimise"]),
                }
            )
    return pd.DataFrame(rows)


def pole_table(rig, window_length):
    """Accuracy of a bank with linear observers, by the identification's pole."""
    rows = []
    for evaluation in ("power", "whiteness"):
        for pole in POLES:
            make = partial(bank_with_pole, pole, evaluation)
            rows.append(
                {
                    "evaluation": evaluation,
                    "pole": str(pole),
                    **accuracy(make, rig, window_length),
                }
            )
    return pd.DataFrame(rows)


def bank_with_pole(pole, evaluation):
    """Bank of order 32 with that pole, innovations evaluated without an observer."""
    return make_pipeline(
        ARXLaguerre(pole=pole), PIObserver(kp=0.0, ki=0.0, evaluation=evaluation), ThresholdLadder()
    )
