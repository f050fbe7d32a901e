"""How verdicts of the diagnoser add up over windows, and what amplitude or adaptation adds."""

from copy import deepcopy

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from benchmarks.cross_speed.protocol import (
    SMALLEST_PROBABILITY,
    check_rig,
    consecutive_groups,
    first_and_second_half,
)
from skarxlag import make_diagnoser

GROUP_SIZES = (1, 2, 5, 10, 20, 50)
LEVEL_DRIFTS = (1.0, 4.0, 16.0)


def log_rms(X):
    """Natural logarithm of the power of the output channel of each window."""
    y = np.asarray(X, dtype=float)
    y = y[:, 0] if y.ndim == 3 else y
    return 2 * np.log(np.maximum(y.std(axis=1), np.finfo(float).tiny))


def speed_pairs(rig, window_length):
    """Residuals, probabilities and levels of the diagnoser at every pair of speeds.

    Yields
    ------
    pair : Bunch
        ``train_rpm``, ``test_rpm``; of the second halves at ``test_rpm`` ``target`` (codes),
        ``recording``, ``start``, ``residual`` and ``log_probability`` (n_windows, n_conditions),
        ``level``; ``level_mean`` and ``level_variance`` of the training windows' conditions;
        ``adapted`` and ``shifted``, residuals after the references have moved by what healthy
        first halves at ``test_rpm`` say: by `SpectralDistance.adapt`, and by all of it.
    """
    check_rig(rig, window_length)
    first, second = first_and_second_half(rig.recording, rig.start, window_length)
    healthy = rig.target_names[0]
    for train_rpm in np.unique(rig.rpm):
        train = first & (rig.rpm == train_rpm)
        y = rig.target[train]
        diagnoser = make_diagnoser(healthy=healthy).fit(rig.data[train], y)
        measure, compare, decide = diagnoser[:-2], diagnoser[-2], diagnoser[-1]
        level = log_rms(rig.data[train])
        level_mean = np.array([level[y == c].mean() for c in decide.classes_])
        deviation = level - level_mean[np.searchsorted(decide.classes_, y)]
        old = train & (rig.target == healthy)
        first_mean = measure.transform(rig.data[old]).mean(axis=0)
        for test_rpm in np.unique(rig.rpm):
            test = second & (rig.rpm == test_rpm)
            new = first & (rig.rpm == test_rpm) & (rig.target == healthy)
            groups, healthy_groups = (measure.transform(rig.data[w]) for w in (test, new))
            residual = compare.transform(groups)
            adapted = deepcopy(compare).adapt(healthy_groups, rig.target[new])
            # Moving all references by all of the shift is moving the windows back by it.
            shift = healthy_groups.mean(axis=0) - first_mean
            probability = decide.predict_proba(residual)
            yield Bunch(
                train_rpm=train_rpm,
                test_rpm=test_rpm,
                target=np.searchsorted(decide.classes_, rig.target[test]),
                recording=rig.recording[test],
                start=rig.start[test],
                residual=residual,
                n_features=compare.joint_references_.shape[-1],
                log_probability=np.log(np.maximum(probability, SMALLEST_PROBABILITY)),
                level=log_rms(rig.data[test]),
                level_mean=level_mean,
                level_variance=np.mean(deviation**2),
                adapted=adapted.transform(groups),
                shifted=compare.transform(groups - shift),
            )


def group_accuracy(pair, size, order):
    """Share of runs of `size` windows whose added-up evidence names the right condition."""
    groups = consecutive_groups(pair.recording, order, size)
    if len(groups) == 0:
        return np.nan
    verdict = pair.log_probability[groups].sum(axis=1).argmax(axis=1)
    return np.mean(verdict == pair.target[groups[:, 0]])


def shuffled(pair, generator):
    """Places in time drawn at random, so that groups are of windows of one recording anywhere."""
    return generator.permutation(len(pair.start))


def serial_correlation(correct, recording, start):
    """Correlation of being right between a window and the next of the same recording.

    Returns
    -------
    pooled : float
        Over all windows: recordings that are hard as a whole count.
    within : float
        Of the deviations from each recording's share, which leaves time alone.

    Examples
    --------
    >>> correct = np.array([1, 1, 0, 0, 0, 0, 1, 1])
    >>> pooled, within = serial_correlation(correct, np.full(8, "a"), np.arange(8))
    >>> round(pooled, 2), round(within, 2)
    (0.42, 0.42)
    """
    pairs = consecutive_groups(recording, start, 2)
    correct = np.asarray(correct, dtype=float)
    share = {name: correct[recording == name].mean() for name in np.unique(recording)}
    centred = correct - np.array([share[name] for name in recording])
    return _correlation(correct[pairs]), _correlation(centred[pairs])


def _correlation(pairs):
    if np.any(np.ptp(pairs, axis=0) == 0):
        return np.nan
    return float(np.corrcoef(pairs.T)[0, 1])


def evidence_table(pairs):
    """Accuracy against the number of windows: as they follow, and drawn from one recording."""
    generator = np.random.default_rng(0)
    cross = [pair for pair in pairs if pair.train_rpm != pair.test_rpm]
    rows = []
    for size in GROUP_SIZES:
        following = [group_accuracy(pair, size, pair.start) for pair in cross]
        drawn = [group_accuracy(pair, size, shuffled(pair, generator)) for pair in cross]
        rows.append(
            {
                "windows": size,
                "consecutive": np.mean(following),
                "worst pair": np.min(following),
                "drawn from the recording": np.mean(drawn),
            }
        )
    return pd.DataFrame(rows)


def correlation_row(pairs):
    """Correlation of being right between neighbours, and recordings that are mostly wrong."""
    cross = [pair for pair in pairs if pair.train_rpm != pair.test_rpm]
    correct = np.concatenate([p.residual.argmin(axis=1) == p.target for p in cross])
    recording = np.concatenate(
        [np.char.add(f"{p.train_rpm:g}>", p.recording.astype(str)) for p in cross]
    )
    start = np.concatenate([p.start for p in cross])
    pooled, within = serial_correlation(correct, recording, start)
    shares = pd.Series(correct).groupby(recording).mean()
    return {
        "accuracy": correct.mean(),
        "correlation with the next": pooled,
        "within a recording": within,
        "recordings below one half": int((shares < 0.5).sum()),
        "recordings": len(shares),
        "their share of all errors": (
            np.mean(shares[recording[~correct]] < 0.5) if not correct.all() else np.nan
        ),
    }


def amplitude_row(pairs):
    """Accuracy with the level as one more feature, by the variance its drift is given."""
    cross = [pair for pair in pairs if pair.train_rpm != pair.test_rpm]
    row = {"without": np.mean([np.mean(p.residual.argmin(axis=1) == p.target) for p in cross])}
    for drift in LEVEL_DRIFTS:
        scores = []
        for p in cross:
            squared = (p.level[:, np.newaxis] - p.level_mean) ** 2 / (p.level_variance + drift)
            total = p.n_features * p.residual.astype(float) ** 2 + squared
            scores.append(np.mean(total.argmin(axis=1) == p.target))
        row[f"drift variance {drift:g}"] = np.mean(scores)
    return row


def adaptation_rows(pairs):
    """Accuracy before and after healthy windows at the new speed, mean and worst pair."""
    cross = [pair for pair in pairs if pair.train_rpm != pair.test_rpm]
    for name, key in (
        ("none", "residual"),
        ("adapt: the smooth part", "adapted"),
        ("all of the shift", "shifted"),
    ):
        scores = [np.mean(p[key].argmin(axis=1) == p.target) for p in cross]
        yield {"references moved by": name, "mean": np.mean(scores), "worst pair": np.min(scores)}
