"""Good and damaged recordings that `signal_quality` refuses.

Good recordings of real rigs pass the filters, converters and gain controls of ordinary
sensors; none should be refused. The same recordings are damaged in several ways; all
should be refused.
"""

import numpy as np

from benchmarks.rigs import BEARING_RIGS, SIX_RIGS, read_rigs
from benchmarks.treatments import DAMAGED, ORDINARY
from skarxlag import signal_quality

RIGS = tuple(dict.fromkeys((*SIX_RIGS, *BEARING_RIGS)))
#: Seconds of rows, and rows of a recording, evenly spread; None is the whole recording.
LENGTHS = {"0.05 s": (0.05, 8), "0.5 s": (0.5, 4), "whole": (None, 1)}
#: Recordings of a rig, evenly spread over all.
MOST_RECORDINGS = 4


def cut(samples, rate, length):
    """Return rows of equal length, evenly spread; an empty array if there are none."""
    seconds, count = LENGTHS[length]
    size = len(samples) if seconds is None else round(seconds * rate)
    count = min(count, len(samples) // size)
    starts = np.linspace(0, len(samples) - size, count).astype(int)
    return np.array([samples[start : start + size] for start in starts])


def lines(home=None, rigs=RIGS, most_recordings=MOST_RECORDINGS):
    """Yield how many rows of each rig, treatment and length are refused."""
    treatments = [
        (group, name, treat)
        for group, each in ORDINARY.items()
        for name, treat in each.items()
    ]
    treatments += [("damaged", name, treat) for name, treat in DAMAGED.items()]
    for rig in read_rigs(rigs, home):
        count = min(most_recordings, len(rig.recordings))
        positions = np.linspace(0, len(rig.recordings) - 1, count).astype(int)
        for number in dict.fromkeys(positions.tolist()):
            recording = rig.recordings[number]
            for group, name, treat in treatments:
                facts = {"rig": rig.name, "recording": number}
                facts |= {"group": group, "treatment": name}
                yield from _refused(facts, recording, rig.sampling_rate, treat)


def _refused(facts, recording, rate, treat):
    """A sensor treats the whole recording; damage meets every row."""
    is_damage = facts["group"] == "damaged"
    samples = recording.samples
    if not is_damage:
        samples, rate = treat(samples, rate)
    for length in LENGTHS:
        rows = cut(samples, rate, length)
        if is_damage:
            rows = np.array([treat(row, rate)[0] for row in rows])
        if len(rows):
            # A shaft may turn at the frequency of the hum.
            rpm = None if is_damage else recording.rpm
            found = signal_quality(rows, sampling_rate=rate, rpm=rpm)
            refused = sum(quality != "good" for quality in found)
            yield facts | {"length": length, "rows": len(rows), "refused": refused}
