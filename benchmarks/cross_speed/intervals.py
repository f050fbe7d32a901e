"""Bootstrap intervals of mean accuracies: recordings are drawn, and rigs, but not windows.

The windows of a recording share its specimen, mounting and load, so their errors come
together. An interval from single windows would be far too narrow.
"""

import numpy as np
import pandas as pd

N_DRAWS = 1000
LEVEL = 0.9


def rig_draws(recordings, random_state=0):
    """Draw the test recordings of a rig anew, within each speed, and average over pairs of speeds.

    Parameters
    ----------
    recordings : DataFrame
        Rows of ``reporting.recording_frame`` of one method, with one rig and window
        length.
    random_state : int, default=0
        Seed. Methods with the same seed have the same draws, so that they can be
        compared.

    Returns
    -------
    means : array of shape (1000,)
        Mean accuracy over ordered pairs of unequal speeds.
    """
    rng = np.random.default_rng(random_state)
    keys = {"index": "train_rpm", "columns": "recording", "aggfunc": "sum"}
    of_speed = []
    for _, rows in recordings.groupby("test_rpm"):
        right = rows.pivot_table(values="right", **keys).to_numpy()
        windows = rows.pivot_table(values="windows", **keys).to_numpy()
        n_recordings = right.shape[1]
        drawn = rng.multinomial(
            n_recordings, np.full(n_recordings, 1 / n_recordings), N_DRAWS
        )
        of_speed.append((drawn @ right.T) / (drawn @ windows.T))
    return np.hstack(of_speed).mean(axis=1)


def mean_draws(of_rigs, random_state=0):
    """Draw rigs, and take a draw of recordings of each: draws of the mean over rigs.

    Parameters
    ----------
    of_rigs : list of array of shape (1000,)
        Results of `rig_draws`, the rigs in the same order for every method.
    random_state : int, default=0
        Seed.

    Returns
    -------
    means : array of shape (1000,)
    """
    n_rigs = len(of_rigs)
    chosen = np.random.default_rng(random_state).integers(
        n_rigs, size=(N_DRAWS, n_rigs)
    )
    return np.array(of_rigs)[chosen, np.arange(N_DRAWS)[:, np.newaxis]].mean(axis=1)


def draws(recordings):
    """Draws of every method on every rig, and of the mean over rigs.

    Parameters
    ----------
    recordings : DataFrame
        Rows of ``reporting.recording_frame`` of one window length, with the columns
        ``rig`` and ``method``.

    Returns
    -------
    DataFrame
        A row for each method and draw; columns are the rigs and "mean of rigs".
    """
    rigs = recordings.rig.unique()
    frames = {}
    for method, rows in recordings.groupby("method", sort=False):
        of_rigs = [
            rig_draws(rows[rows.rig == rig], random_state=number)
            for number, rig in enumerate(rigs)
        ]
        frame = pd.DataFrame(dict(zip(rigs, of_rigs, strict=True)))
        frames[method] = frame.assign(**{"mean of rigs": mean_draws(of_rigs)})
    return pd.concat(frames, names=["method", "draw"])


def interval(values):
    """Return the limits that hold 90 % of the draws.

    Examples
    --------
    >>> interval(np.arange(101) / 100)
    '0.050 to 0.950'
    """
    tail = (1 - LEVEL) / 2
    low, high = np.quantile(values, [tail, 1 - tail])
    return f"{low:.3f} to {high:.3f}"
