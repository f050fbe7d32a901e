"""Fault locations by the orders of the bearing: right, wrong and abstained, rig by rig.

Run ``python -m benchmarks.fault_orders`` from the root of the repository.
"""

import sys
from functools import partial
from itertools import product
from time import process_time

import numpy as np
import pandas as pd
from scipy.stats import gumbel_r

from benchmarks.fault_orders.choices import SLIPS, slips_left_out, visible_left_out
from benchmarks.fault_orders.methods import METHODS, PEERS
from benchmarks.fault_orders.rigs import RIGS, recordings
from benchmarks.fault_orders.tables import (
    compared,
    counted,
    with_reference,
)
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.pages.kept import is_current, kept_or_computed
from skarxlag import FaultOrderClassifier
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS

BLOCK = "fault orders {}"
#: Name in `benchmarks.pages.parts`.
PART = "fault-orders"
_OURS = next(iter(METHODS))


def parse(arguments):
    parser = page_parser(__doc__, "fault_orders")
    parser.add_argument(
        "--rig",
        nargs="+",
        choices=list(RIGS),
        default=list(RIGS),
    )
    parser.add_argument(
        "--method",
        nargs="+",
        choices=[*METHODS, *PEERS],
        default=list(METHODS),
        metavar="METHOD",
        help=f"of {', '.join([*METHODS, *PEERS])}; results of other runs of this code are kept, "
        "so that peers may run in separate environments",
    )
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument(
        "--settings", action="store_true", help="choose the slip by leaving rigs out"
    )
    parser.add_argument(
        "--null",
        action="store_true",
        help="fit the distribution of healthy stretches' scores",
    )
    parser.add_argument(
        "--visible",
        action="store_true",
        help="choose the share of faults that show their comb by leaving rigs out",
    )
    return parser.parse_args(arguments)


def whole(name, rig, method):
    """Score whole recordings by a method.

    Parameters
    ----------
    name : str
        The rig.
    rig : list of Recording
        Its recordings.
    method : str
        Of `METHODS` or `PEERS`.

    Returns
    -------
    DataFrame
        ``rig``, ``method``, ``recording``, ``location``, a score for each location, and
        ``ms`` of processor time for each second of signal.
    """
    rows = []
    for recording in rig:
        clock = process_time()
        scores = (METHODS | PEERS)[method](recording)
        seconds = len(recording.samples) / recording.rate
        facts = {
            "rig": name,
            "method": method,
            "recording": recording.name,
            "location": recording.location,
        }
        of_location = dict(zip(FAULT_LOCATIONS, scores, strict=True))
        rows.append(
            facts | of_location | {"ms": (process_time() - clock) * 1e3 / seconds}
        )
    return pd.DataFrame(rows)


def stretches(name, rig):
    """Score stretches of 1 s.

    Parameters
    ----------
    name : str
        The rig.
    rig : list of Recording
        Its recordings.

    Returns
    -------
    DataFrame
        ``rig``, ``recording``, ``location``, ``rpm``, ``second`` and a score for each
        location.
    """
    frames = []
    for recording in rig:
        X = recording.samples.reshape(-1, int(recording.rate))
        classifier = FaultOrderClassifier(
            bearing=recording.bearing, sampling_rate=recording.rate
        ).fit(X)
        scores = classifier.match(X, rpm=recording.rpm).scores
        facts = {
            "rig": name,
            "recording": recording.name,
            "location": recording.location,
            "rpm": recording.rpm,
            "second": np.arange(len(X)),
        }
        frame = pd.DataFrame(scores, columns=list(FAULT_LOCATIONS))
        frames.append(pd.DataFrame(facts).join(frame))
    return pd.concat(frames)


def blocks(recorded, seconds, chosen):
    """Return the Markdown blocks of the page by name."""
    ours = recorded[recorded["method"] == _OURS]
    texts = {
        "named": "Whole recordings, nominal speed, nothing trained, stated rates of .02. "
        "Abstained: healthy or not identifiable.\n\n" + markdown(counted(ours)),
        "methods": "Right locations without abstaining. Every method has the bearing and the "
        "nominal speed. Peers have 5 s of each recording.\n\n"
        + markdown(compared(recorded)),
        "stretches": "Stretches of 1 s, as in the first table.\n\n"
        + markdown(counted(seconds)),
        "reference": "Healthy stretches of 1 s as the reference, stated false-alarm rate .02.\n\n"
        + markdown(with_reference(seconds)),
    }
    if chosen is not None:
        texts["settings"] = (
            f"{len(SLIPS)} values were scored. For each rig, the slip that is best on the mean "
            f"of all other rigs. The mean of the column is {chosen['right'].mean():.3f}.\n\n"
            + markdown(chosen)
        )
    return {BLOCK.format(name): text for name, text in texts.items()}


def cost_of_one_second():
    """Return milliseconds of processor time for 1 s at 51.2 kHz."""
    samples = np.random.default_rng(0).normal(size=(1, 51_200))
    classifier = FaultOrderClassifier(bearing="6205", sampling_rate=51_200.0)
    classifier.fit(samples)
    times = []
    for _ in range(20):
        clock = process_time()
        classifier.match(samples, rpm=1024)
        times.append(process_time() - clock)
    return 1e3 * float(np.median(times))


def main(arguments=None):
    options = parse(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    rigs = {name: recordings(name, options.data_home) for name in options.rig}
    recorded = []
    for (name, rig), method in product(rigs.items(), METHODS | PEERS):
        path = options.output / f"{name}; {method}.csv"
        # Peers may have run in another environment.
        if method in options.method or is_current(path, PART):
            compute = partial(whole, name, rig, method)
            recorded.append(kept_or_computed(path, PART, compute))
            print(f"{name}: {method}", file=sys.stderr, flush=True)
    recorded = pd.concat(recorded, ignore_index=True)
    if _OURS not in set(recorded["method"]):
        # A run of peers alone leaves its results to a run with ours.
        return
    seconds = [
        kept_or_computed(
            options.output / f"{name}; stretches.csv",
            PART,
            partial(stretches, name, rig),
        )
        for name, rig in rigs.items()
    ]
    seconds = pd.concat(seconds, ignore_index=True)
    chosen = slips_left_out(rigs) if options.settings else None
    if options.null:
        healthy = seconds[seconds["location"] == "healthy"]
        location, scale = gumbel_r.fit(healthy[list(FAULT_LOCATIONS)].max(axis=1))
        print(f"healthy stretches: location {location:.3f}, scale {scale:.3f} nepers")
    if options.visible:
        ours = recorded[recorded["method"] == _OURS]
        print(visible_left_out(ours, seconds).to_string(index=False))
    print(f"1 s at 51.2 kHz: {cost_of_one_second():.1f} ms")
    publish(options, blocks(recorded, seconds, chosen))
