"""From the scores of speed pairs to data frames, Markdown tables and a block of a README."""

from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.cross_speed.protocol import GROUP_SIZE
from benchmarks.pages.blocks import markdown

RUN = ["rig", "window_length", "method"]
#: Names of the marked blocks of a Markdown file: means alone, and everything.
OVERVIEW = "cross-speed overview"
TABLES = "cross-speed tables"
#: Results of the methods that take hours. They are added to those of a run.
STORED = Path(__file__).parent / "stored"
#: End of the name of a method that runs with several seeds.
_SEED = r", seed \d+$"
#: Columns that differ between seeds.
_SCORES = {"accuracy", "balanced_accuracy", "fit_seconds", "predict_seconds", "right"}


def pair_frame(pairs):
    """One row for each speed pair and kind of verdict.

    Parameters
    ----------
    pairs : iterable of dict
        What ``protocol.leave_one_speed_in`` yields.

    Returns
    -------
    frame : DataFrame
        ``train_rpm``, ``test_rpm``, ``verdict`` ("window" or "group"), ``accuracy``,
        ``balanced_accuracy``, ``verdicts``, ``evidence``, ``fit_seconds``,
        ``predict_seconds``.
    """
    return pd.DataFrame(
        {
            "train_rpm": pair["train_rpm"],
            "test_rpm": pair["test_rpm"],
            "verdict": verdict,
            "accuracy": pair[verdict]["accuracy"],
            "balanced_accuracy": pair[verdict]["balanced_accuracy"],
            "verdicts": pair[verdict]["verdicts"],
            "evidence": pair["evidence"] if verdict == "group" else "predict",
            "fit_seconds": pair["fit_seconds"],
            "predict_seconds": pair["predict_seconds"],
        }
        for pair in pairs
        for verdict in ("window", "group")
    )


def recording_frame(pairs):
    """Number of windows and of right verdicts of each test recording, at each training speed.

    Parameters
    ----------
    pairs : iterable of dict
        What ``protocol.leave_one_speed_in`` yields.

    Returns
    -------
    frame : DataFrame
        ``train_rpm``, ``test_rpm``, ``recording``, ``windows``, ``right``, of unequal
        speeds.
    """
    return pd.concat(
        pair["recordings"].assign(
            train_rpm=pair["train_rpm"], test_rpm=pair["test_rpm"]
        )
        for pair in pairs
        if pair["train_rpm"] != pair["test_rpm"]
    )


def confusion_frame(pairs):
    """Counts of (true, predicted), summed over the pairs of unequal speeds.

    Parameters
    ----------
    pairs : iterable of dict
        What ``protocol.leave_one_speed_in`` yields.

    Returns
    -------
    frame : DataFrame
        ``verdict``, ``true``, ``predicted``, ``count``; combinations that do not occur
        are left out.
    """
    counts = pd.DataFrame(
        (
            (verdict, true, predicted, count)
            for pair in pairs
            if pair["train_rpm"] != pair["test_rpm"]
            for verdict in ("window", "group")
            for (true, predicted), count in pair[verdict]["confusion"].items()
        ),
        columns=["verdict", "true", "predicted", "count"],
    )
    return counts.groupby(["verdict", "true", "predicted"], as_index=False).sum()


def summarise(pairs):
    """Means and the worst pair of each run.

    Parameters
    ----------
    pairs : DataFrame
        Rows of :func:`pair_frame` with the columns ``rig``, ``window_length``,
        ``method``.

    Returns
    -------
    summary : DataFrame
        One row for each run and kind of verdict: ``mean``, ``balanced`` (mean balanced
        accuracy) and ``worst`` over the ordered pairs of unequal speeds, ``worst_pair``
        (train -> test), ``same_speed``, ``verdicts`` (over the unequal pairs),
        ``evidence``, and ``seconds`` of processor time for all fits and predictions of
        single windows.
    """
    rows = []
    for key, group in pairs.groupby([*RUN, "verdict"], sort=False):
        same = group.train_rpm == group.test_rpm
        cross = group[~same].reset_index(drop=True)
        worst = cross.loc[cross.accuracy.fillna(np.inf).idxmin()]
        fit_seconds = group.drop_duplicates("train_rpm").fit_seconds.sum()
        rows.append(
            {
                **dict(zip([*RUN, "verdict"], key, strict=True)),
                "mean": cross.accuracy.mean(),
                "worst": worst.accuracy,
                "worst_pair": f"{worst.train_rpm:g} -> {worst.test_rpm:g}",
                "same_speed": group[same].accuracy.mean(),
                "balanced": cross.balanced_accuracy.mean(),
                "verdicts": cross.verdicts.sum(),
                "evidence": group.evidence.iloc[0],
                "seconds": fit_seconds + group.predict_seconds.sum(),
            }
        )
    return pd.DataFrame(rows)


def with_stored(path):
    """Read the results of a run, and add the stored ones of methods that it did not repeat.

    Parameters
    ----------
    path : Path
        CSV file of the run; `STORED` holds one of the same name.

    Returns
    -------
    frame : DataFrame
        Stored results are of the same rigs and window lengths.
    """
    frame = pd.read_csv(path)
    stored = pd.read_csv(STORED / path.name)
    scored = frame[RUN[:2]].drop_duplicates()
    stored = stored.merge(scored)[frame.columns]
    return pd.concat(
        [frame, stored[~stored.method.isin(frame.method)]], ignore_index=True
    )


def has_run(folder, rig, window_length, method):
    """Return whether a folder of results holds this run."""
    path = folder / "pairs.csv"
    if not path.exists():
        return False
    return (pd.read_csv(path)[RUN] == [rig, window_length, method]).all(axis=1).any()


def mean_of_seeds(frame):
    """Replace the seeds of a method by their mean.

    Parameters
    ----------
    frame : DataFrame
        Rows of :func:`pair_frame` or :func:`recording_frame`, with a column ``method``.

    Returns
    -------
    frame : DataFrame
        The other rows are unchanged.
    """
    seeded = frame.method.str.contains(_SEED)
    if not seeded.any():
        return frame
    scores = [*_SCORES.intersection(frame.columns)]
    keys = [name for name in frame if name not in scores]
    runs = frame[seeded]
    runs = runs.assign(method=runs.method.str.replace(_SEED, "", regex=True))
    means = runs.groupby(keys, as_index=False, sort=False)[scores].mean()
    return pd.concat([frame[~seeded], means], ignore_index=True)


def merge(path, rows, run):
    """Write `rows` of one run to a CSV file, and replace earlier rows of the same run.

    Parameters
    ----------
    path : Path
        CSV file; made when it does not exist.
    rows : DataFrame
        Results of the run.
    run : dict
        Columns that identify the run, such as ``rig``, ``window_length`` and
        ``method``.

    Returns
    -------
    merged : DataFrame
        The whole content of the file.
    """
    rows = rows.assign(**run)[[*run, *rows.columns]]
    if Path(path).exists():
        old = pd.read_csv(path)
        others = ~np.logical_and.reduce(
            [old[name] == value for name, value in run.items()]
        )
        if others.any():
            rows = pd.concat([old[others], rows], ignore_index=True)
    rows.to_csv(path, index=False)
    return rows


def rig_table(summary):
    """Return a Markdown table of one rig: a row for each method, best cross-speed mean first.

    Parameters
    ----------
    summary : DataFrame
        Rows of :func:`summarise` of one rig.

    Returns
    -------
    table : str
    """
    lengths = sorted(summary.window_length.unique())
    wide = {
        (verdict, length): rows.set_index("method")
        for (verdict, length), rows in summary.groupby(["verdict", "window_length"])
    }
    head = ["method"]
    columns = []
    for length in lengths:
        windows = wide["window", length]
        groups = wide["group", length]
        head += [
            f"{length}: {name}"
            for name in ("mean", "worst pair", "same speed", "balanced")
        ]
        head += [f"{GROUP_SIZE} x {length}: {name}" for name in ("mean", "worst pair")]
        columns += [
            windows[name] for name in ("mean", "worst", "same_speed", "balanced")
        ]
        columns += [groups[name] for name in ("mean", "worst")]
    body = pd.concat(columns, axis=1, keys=range(len(columns))).sort_values(
        0, ascending=False
    )
    body = body.rename_axis("method").reset_index()
    body.columns = head
    return markdown(body)


def report(summary):
    """Return the tables of all rigs as Markdown, with the meaning of the columns.

    Parameters
    ----------
    summary : DataFrame
        Rows of :func:`summarise`.

    Returns
    -------
    text : str
    """
    parts = [
        "Fitted on the first halves of the recordings of one speed, scored "
        "on the second halves at every other speed. Accuracy of single windows (their length in "
        f"samples leads the columns) and of {GROUP_SIZE} consecutive windows: mean over all "
        "ordered pairs of speeds, worst pair; mean over the pairs of equal speeds; mean balanced "
        "accuracy. Every peer sees windows centred and scaled to unit RMS."
    ]
    for rig, rows in summary.groupby("rig", sort=False):
        parts.append(
            f"<details>\n<summary>{rig}: all methods</summary>\n\n{rig_table(rows)}\n\n</details>"
        )
    return "\n\n".join(parts)
