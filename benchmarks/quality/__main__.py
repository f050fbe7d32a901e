"""Share of good and of damaged recordings that `signal_quality` refuses.

Run ``python -m benchmarks.quality`` from the root of the repository. Good recordings of
real rigs, and of a simulated bearing for up to ten minutes, pass the filters,
converters and gain controls of ordinary sensors. None of them should be refused. The
same recordings are damaged in several ways. All of them should be refused. The folder
of the real rigs is ``$SKARXLAG_DATA``.
"""

import os

import numpy as np
import pandas as pd

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.quality.rigs import all_rigs, simulated_rig
from benchmarks.quality.treatments import DAMAGED, ORDINARY
from skarxlag import signal_quality

#: Seconds of rows, and rows of a recording, evenly spread; None is the whole recording.
LENGTHS = {0.05: 8, 0.5: 4, 2.0: 2, None: 1}
#: Seconds of the simulated recordings.
SIMULATED = (60, 600)
#: Recordings of a rig, evenly spread over all.
MOST_RECORDINGS = 8
#: Longer recordings are not resampled to a higher rate: they would need too much
#: memory.
_MOST_SAMPLES = 2**24


def rows_of(samples, rate, seconds, count):
    """Return up to so many rows of equal length, evenly spread over a recording.

    A recording that is shorter than a row yields none.
    """
    length = len(samples) if seconds is None else round(seconds * rate)
    count = min(count, len(samples) // length)
    starts = np.linspace(0, len(samples) - length, count).astype(int)
    return np.stack([samples[s : s + length] for s in starts]) if count > 0 else None


def chosen(rig, most):
    """Return some of the recordings of a rig, evenly spread over all."""
    count = min(most, len(rig.recordings))
    positions = np.linspace(0, len(rig.recordings) - 1, count).astype(int)
    return [rig.recordings[position] for position in positions]


def judged(rig, recording, treatment, rows, rate, rpm):
    """Yield what is known of each row, and its quality."""
    facts = {"rig": rig.name, "condition": recording.condition, "treatment": treatment}
    for quality in signal_quality(rows, sampling_rate=rate, rpm=rpm):
        yield facts | {"seconds": rows.shape[1] / rate, "quality": quality}


def good_rows(rig, lengths, treatments, most=MOST_RECORDINGS):
    """Yield the quality of the rows of treated recordings.

    Parameters
    ----------
    rig : Rig
        As `all_rigs` yields it.
    lengths : dict of float or None to int
        Seconds of rows, and rows of a recording.
    treatments : dict of str to callable
        They are applied to a whole recording, as a sensor does it.
    most : int
        Recordings, at most.
    """
    for recording in chosen(rig, most):
        for name, treat in treatments.items():
            treated, rate = treat(recording.samples.astype(float), rig.sampling_rate)
            if len(treated) > max(_MOST_SAMPLES, len(recording.samples)):
                continue
            for seconds, count in lengths.items():
                rows = rows_of(treated, rate, seconds, count)
                if rows is not None:
                    facts = {"length": length_name(seconds)}
                    for row in judged(rig, recording, name, rows, rate, recording.rpm):
                        yield row | facts


def damaged_rows(rig, lengths, treatments, most=MOST_RECORDINGS):
    """Yield the quality of damaged rows, as `good_rows` does; every row has the damage."""
    rate = rig.sampling_rate
    for recording in chosen(rig, most):
        for seconds, count in lengths.items():
            rows = rows_of(recording.samples, rate, seconds, count)
            for name, damage in treatments.items() if rows is not None else ():
                broken = np.stack([damage(row, rate)[0] for row in rows])
                facts = {"length": length_name(seconds)}
                # A shaft may turn at the frequency of the hum.
                for row in judged(rig, recording, name, broken, rate, None):
                    yield row | facts


def length_name(seconds):
    """Return the heading of rows of a length."""
    return "whole" if seconds is None else f"{seconds:g} s"


def refused(rows, index, columns):
    """Return the share of rows that are refused, in percent and rounded up, as texts."""
    bad = rows.assign(refused=rows["quality"] != "good")
    options = {"index": index, "columns": columns, "values": "refused", "sort": False}
    share = bad.pivot_table(**options) * 100
    share["all"] = bad.groupby(index, sort=False)["refused"].mean() * 100
    texts = share.map(lambda each: "" if np.isnan(each) else _rounded_up(each))
    return texts.reset_index()


def _rounded_up(percent):
    """Return a share with one digit, which is 0 only if nothing is refused."""
    return f"{np.ceil(10 * percent - 1e-9) / 10 + 0.0:.1f}".removesuffix(".0")


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "quality")
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    parser.add_argument(
        "--rig", nargs="*", help="names of rigs; default: all and the simulated"
    )
    parser.add_argument(
        "--recordings", type=int, default=MOST_RECORDINGS, help="of each rig"
    )
    text = "seconds of the simulated recordings"
    parser.add_argument("--seconds", type=int, nargs="*", default=SIMULATED, help=text)
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    groups = {name: group for group, each in ORDINARY.items() for name in each}
    ordinary = {
        name: treat for each in ORDINARY.values() for name, treat in each.items()
    }
    good = []
    damaged = []
    rigs = [] if options.data_home is None else all_rigs(options.data_home)
    for rig in rigs:
        if options.rig is None or rig.name in options.rig:
            good += good_rows(rig, LENGTHS, ordinary, options.recordings)
            damaged += damaged_rows(rig, LENGTHS, DAMAGED, options.recordings)
    for seconds in options.seconds:
        rig = simulated_rig(seconds)
        good += good_rows(rig, LENGTHS, ordinary)
        damaged += damaged_rows(rig, LENGTHS, DAMAGED)
    good = pd.DataFrame(good)
    damaged = pd.DataFrame(damaged)
    good["group"] = good["treatment"].map(groups)
    good.to_csv(options.output / "good.csv", index=False)
    damaged.to_csv(options.output / "damaged.csv", index=False)
    n_good = len(good)
    n_damaged = len(damaged)
    parts = [
        f"Good rows that are refused, in percent of {n_good}:",
        markdown(refused(good, "rig", "group")),
        "The same rows, by treatment and length:",
        markdown(refused(good, "treatment", "length")),
        f"Damaged rows that are refused, in percent of {n_damaged}:",
        markdown(refused(damaged, "treatment", "length")),
    ]
    publish(options, {"signal quality": "\n\n".join(parts)})


if __name__ == "__main__":
    main()
