"""The tables of the first page: a method in a row, all real rigs, with intervals."""

import pandas as pd

from benchmarks.cross_speed.intervals import draws, interval
from benchmarks.cross_speed.peers import BATCH, LEFT_OUT, OURS, PLAIN
from benchmarks.pages.blocks import markdown

DIFFERENCES = "cross-speed differences"
REFERENCE = "make_diagnoser"
#: Methods of the small tables, if they were run on every rig.
SHOWN = [REFERENCE, LEFT_OUT, "make_extended_state_pio", *PLAIN, "QUANT", "MiniRocket"]
MEAN = "mean of rigs"
_PROTOCOL = (
    "Share of right verdicts on single windows at speeds that were not used for training: mean "
    "over the rigs, worst rig, worst pair of speeds of any rig, and mean of each rig over its "
    "ordered pairs of speeds. No method receives the speed. The interval holds 90 % of 1000 "
    "bootstrap draws of rigs, and of recordings within a rig and a speed."
)
_BATCH = (
    "The last row is another protocol: the method standardises its features over all test windows "
    "of a speed, and so needs an unlabelled batch that holds every condition equally often."
)


def overview(summary, recordings):
    """Markdown of the tables of the first page, one for each length of windows.

    Parameters
    ----------
    summary : DataFrame
        Rows of ``reporting.summarise``.
    recordings : DataFrame
        Rows of ``reporting.recording_frame``.

    Returns
    -------
    text : str
        The methods in `SHOWN`, by their mean over the rigs; then those of another
        protocol. A method that was not run on every rig is left out. The best figure of
        each column among the methods of one protocol is bold.
    """
    shown = [*SHOWN, *BATCH]
    summary = _complete(summary[summary.method.isin(shown)])
    recordings = _complete(recordings[recordings.method.isin(shown)])
    parts = [_PROTOCOL]
    if summary.method.isin(BATCH).any():
        parts.append(_BATCH)
    for length, rows in summary[summary.verdict == "window"].groupby("window_length"):
        table = accuracy_table(rows, recordings[recordings.window_length == length])
        parts += [f"Windows of {length} samples:", markdown(table)]
    return "\n\n".join(parts)


def _complete(frame):
    """Rows on real rigs of the methods that were run on each of them with the same windows."""
    real = frame[~frame.rig.str.startswith("simulated")]
    n_rigs = real.groupby(["window_length", "method"]).rig.transform("nunique")
    return real[n_rigs == real.rig.nunique()]


def accuracy_table(summary, recordings):
    """A row for each method: mean over rigs with its interval, worst rig and pair, and each rig."""
    means = summary.pivot(index="method", columns="rig", values="mean")[
        summary.rig.unique()
    ]
    table = pd.DataFrame(
        {
            MEAN: means.mean(axis=1),
            "worst rig": means.min(axis=1),
            "worst pair": summary.groupby("method").worst.min(),
            **means,
        }
    )
    table = table.sort_values(MEAN, ascending=False)
    is_batch = table.index.isin(list(BATCH))
    best = table[~is_batch].max()
    cells = table.apply(
        lambda column: column.map(lambda each: _cell(each, best[column.name]))
    )
    cells = pd.concat([cells[~is_batch], table[is_batch].map("{:.3f}".format)])
    of_methods = draws(recordings)[MEAN]
    cells.insert(
        1, "90 % interval", [interval(of_methods[name]) for name in cells.index]
    )
    return cells.rename(index=_label).rename_axis("method").reset_index()


def _cell(value, best):
    return f"**{value:.3f}**" if round(value, 3) == round(best, 3) else f"{value:.3f}"


def _label(name):
    if name not in OURS:
        return name
    function, comma, rest = name.partition(", ")
    return f"`{function}`{comma}{rest} (ours)"


def differences(recordings):
    """Markdown of the accuracy of `make_diagnoser` minus that of every other method.

    Parameters
    ----------
    recordings : DataFrame
        Rows of ``reporting.recording_frame``.
    """
    real = _complete(recordings)
    parts = [
        f"Accuracy of `{REFERENCE}` minus that of another method, mean over the rigs, with the "
        "interval of 90 % of 1000 bootstrap draws of rigs and recordings. Both methods have the "
        "same draws."
    ]
    for length, rows in real.groupby("window_length"):
        drawn = draws(rows)
        if REFERENCE not in drawn.index.get_level_values("method"):
            continue
        parts.append(better_peers(rows, length))
        means = rig_means(rows)
        lines = []
        for method in drawn.index.get_level_values("method").unique().drop(REFERENCE):
            minus = drawn.loc[REFERENCE] - drawn.loc[method]
            line = {
                "method": method,
                MEAN: f"{(means[REFERENCE] - means[method]).mean():+.3f}",
            }
            line |= {"90 % interval": interval(minus[MEAN])}
            line |= {f"{rig}: 90 %": interval(minus[rig]) for rig in rows.rig.unique()}
            lines.append(line)
        table = pd.DataFrame(lines).sort_values(
            MEAN, key=lambda each: each.astype(float)
        )
        parts += [f"Windows of {length} samples:", markdown(table)]
    return "\n\n".join(parts)


def rig_means(recordings):
    """Mean accuracy over pairs of speeds: a row for each rig, a column for each method."""
    keys = ["rig", "method", "train_rpm", "test_rpm"]
    sums = recordings.groupby(keys, sort=False)[["right", "windows"]].sum()
    accuracy = sums.right / sums.windows
    return accuracy.groupby(["rig", "method"], sort=False).mean().unstack()


def better_peers(recordings, window_length):
    """Sentence on the rigs on which the best peer has a higher mean than `make_diagnoser`."""
    ahead = []
    for rig, means in rig_means(recordings).iterrows():
        ours = means[REFERENCE]
        # A method of another protocol is no peer.
        best = means.drop([*OURS, *BATCH], errors="ignore").nlargest(1)
        ahead += [
            f"{rig} ({name}, {mean:.3f} against {ours:.3f})"
            for name, mean in best[best > ours].items()
        ]
    return (
        f"Windows of {window_length} samples: rigs on which a peer has a higher mean than "
        f"`{REFERENCE}`, with the best peer: {', '.join(ahead) or 'none'}."
    )
