"""Places of faults by the orders of the bearing: right, wrong and abstained, rig by rig.

Run ``python -m benchmarks.fault_orders`` from the root of the repository.
"""

import sys
from functools import partial
from itertools import product
from time import process_time

import numpy as np
import pandas as pd
from scipy.stats import gumbel_r, rankdata
from sklearn.utils import Bunch

from benchmarks.fault_orders.methods import METHODS, PEERS
from benchmarks.fault_orders.rigs import RIGS, recordings
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.pages.kept import is_current, kept_or_computed
from skarxlag import FaultOrderClassifier
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS
from skarxlag.core.fault_locations import HEALTHY, NOT_IDENTIFIABLE
from skarxlag.decisions.comb_probabilities import VISIBLE_ALONE, comb_evidence
from skarxlag.kernels.fault_orders import (
    contrast_parts,
    fault_comb,
    order_contrast,
)

BLOCK = "fault orders {}"
#: Name in `benchmarks.pages.parts`.
PART = "fault-orders"
_OURS = next(iter(METHODS))
_RACES = ("inner", "outer")
#: Settings that are scored: weights of the three contrasts, weight of the cage, and
#: slip.
_SETTINGS = list(
    product(
        [
            (1, 0, 0),
            (0, 1, 0),
            (1, 1, 0),
            (1, 1, 0.4),
            (1, 1, 1),
            (1, 0, 0.4),
            (0, 1, 0.4),
        ],
        [0.3, 0.6, 0.9],
        [0.02, 0.03, 0.05],
    )
)
#: Shares of faults that show their comb, which are scored.
_VISIBLE = (0.1, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9)


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
        "--settings", action="store_true", help="choose settings by leaving rigs out"
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
        ``rig``, ``method``, ``recording``, ``place``, a score for each place, and
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
            "place": recording.place,
        }
        of_place = dict(zip(FAULT_LOCATIONS, scores, strict=True))
        rows.append(facts | of_place | {"ms": (process_time() - clock) * 1e3 / seconds})
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
        ``rig``, ``recording``, ``place``, ``rpm``, ``second`` and a score for each
        place.
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
            "place": recording.place,
            "rpm": recording.rpm,
            "second": np.arange(len(X)),
        }
        frame = pd.DataFrame(scores, columns=list(FAULT_LOCATIONS))
        frames.append(pd.DataFrame(facts).join(frame))
    return pd.concat(frames)


def settings_left_out(rigs):
    """Return the accuracy on each rig with the settings that are best on all others.

    Parameters
    ----------
    rigs : dict of str to list of Recording

    Returns
    -------
    DataFrame
        ``rig``, ``chosen`` settings, ``accuracy`` with them, and ``ours``, that of the
        defaults.
    """
    accuracy = {}
    for name, rig in rigs.items():
        faulty = [recording for recording in rig if recording.place in FAULT_LOCATIONS]
        right = np.zeros((len(_SETTINGS), len(faulty)))
        for column, recording in enumerate(faulty):
            turn = 60 * recording.rate / recording.rpm
            parts = contrast_parts(recording.samples, turn, recording.rate)
            for row, (weights, cage, slip) in enumerate(_SETTINGS):
                contrast = np.array(weights) / sum(weights) @ parts
                scores = fault_comb(contrast, recording.orders, 0.1, slip, cage).scores
                right[row, column] = FAULT_LOCATIONS[scores.argmax()] == recording.place
        accuracy[name] = right.mean(axis=1)
    frame = pd.DataFrame(accuracy)
    default = _SETTINGS.index(((1, 1, 0.4), 0.6, 0.03))
    rows = []
    for name in frame:
        best = int(frame.drop(columns=name).mean(axis=1).argmax())
        weights, cage, slip = _SETTINGS[best]
        rows.append(
            {
                "rig left out": name,
                "weights": " : ".join(f"{w:g}" for w in weights),
                "cage": cage,
                "slip": slip,
                "right": frame.loc[best, name],
                "right with the defaults": frame.loc[default, name],
            }
        )
    return pd.DataFrame(rows)


def visible_left_out(recorded, seconds):
    """Return log losses with the share of visible combs that is best on all other rigs.

    Parameters
    ----------
    recorded, seconds : DataFrame
        ``rig``, ``place`` and a score for each place, of recordings and of stretches.

    Returns
    -------
    DataFrame
        ``rig left out``, the share ``visible``, and the ``loss`` with it and ``loss in
        use``.
    """
    limit = (
        FaultOrderClassifier(bearing="6205", sampling_rate=1e3)
        .fit(np.ones((1, 9)))
        .limit_
    )
    losses = {}
    for rig in recorded["rig"].unique():
        parts = [rows[rows["rig"] == rig] for rows in (recorded, seconds)]
        for visible in _VISIBLE:
            of_parts = []
            for rows in parts:
                beyond = rows[list(FAULT_LOCATIONS)].to_numpy() - limit
                found = comb_evidence(beyond, np.arange(4), visible=visible)
                true = rows["place"].map([*FAULT_LOCATIONS, HEALTHY].index)
                of_parts.append(-found[np.arange(len(rows)), true].mean())
            losses[rig, visible] = np.mean(of_parts)
    table = pd.Series(losses).unstack(0)
    best = {rig: table.drop(columns=rig).mean(axis=1).idxmin() for rig in table}
    found = [
        (rig, v, table.loc[v, rig], table.loc[VISIBLE_ALONE, rig])
        for rig, v in best.items()
    ]
    return pd.DataFrame(
        found, columns=["rig left out", "visible", "loss", "loss in use"]
    )


def verdicts(scores, **options):
    """Return places and verdicts that the classifier derives from scores.

    Parameters
    ----------
    scores : ndarray of shape (n, 3)
    **options
        Of `FaultOrderClassifier`.

    Returns
    -------
    list of str
    """
    fitted = FaultOrderClassifier(bearing="6205", sampling_rate=1e3, **options).fit(
        np.ones((1, 9))
    )
    return fitted._judge(_matched(scores, np.ones(len(scores)))).named


def area_under_curve(faulty, healthy):
    """Return the probability that a faulty recording has the larger score.

    Examples
    --------
    >>> area_under_curve([3, 2], [1, 2])
    0.875
    """
    ranks = rankdata([*faulty, *healthy])[: len(faulty)]
    n_faulty = len(faulty)
    return float(
        (ranks.sum() - n_faulty * (n_faulty + 1) / 2) / (n_faulty * len(healthy))
    )


def counted(rows):
    """Return right, wrong and abstained by rig and place, and right without abstaining."""
    scores = rows[list(FAULT_LOCATIONS)].to_numpy()
    rows = rows.assign(
        forced=[FAULT_LOCATIONS[i] for i in scores.argmax(axis=1)],
        verdict=verdicts(scores),
    )
    found = []
    for (rig, place), group in rows.groupby(["rig", "place"], sort=False):
        named = group[~group["verdict"].isin(["healthy", NOT_IDENTIFIABLE])]
        line = {"rig": rig, "place": place, "recordings": len(group)}
        if place == "healthy":
            right = (group["verdict"] == "healthy").sum()
            wrong = len(named)
        else:
            right = (named["verdict"] == place).sum()
            wrong = len(named) - right
        line |= {
            "right": right,
            "wrong": wrong,
            "abstained": len(group) - right - wrong,
        }
        forced = (
            "" if place == "healthy" else f"{(group['forced'] == place).mean():.2f}"
        )
        found.append(line | {"right without abstaining": forced})
    return pd.DataFrame(found)


def mean_accuracy(rows, places=FAULT_LOCATIONS):
    """Return the share of right locations on each rig, without abstaining."""
    faulty = rows[rows["place"].isin(places)]
    best = faulty[list(FAULT_LOCATIONS)].to_numpy().argmax(axis=1)
    right = pd.Series(
        np.array(FAULT_LOCATIONS)[best] == faulty["place"], index=faulty.index
    )
    return right.groupby(faulty["rig"], sort=False).mean()


def compared(rows):
    """Each method: right on the mean of rigs, races, and races above all healthy recordings."""
    found = []
    for method, group in rows.groupby("method", sort=False):
        by_rig = mean_accuracy(group)
        best = group[list(FAULT_LOCATIONS)].max(axis=1)
        healthy = best[group["place"] == "healthy"].max()
        races = group[group["place"].isin(_RACES)]
        named = (
            np.array(FAULT_LOCATIONS)[
                races[list(FAULT_LOCATIONS)].to_numpy().argmax(axis=1)
            ]
            == races["place"]
        )
        above = (best[races.index] > healthy) & named
        found.append(
            {
                "method": method,
                "mean of rigs": by_rig.mean(),
                "races": mean_accuracy(group, _RACES).mean(),
                "races right and above every healthy recording": above.mean(),
                **by_rig,
                "ms for 1 s": group["ms"].median(),
            }
        )
    return pd.DataFrame(found).sort_values("mean of rigs", ascending=False)


def with_reference(rows, rate=0.02):
    """False alarms of healthy stretches with healthy rows of the machine as the reference.

    The first half of each healthy recording calibrates, the second half is tested; or
    recordings of all speeds but one calibrate, and the last speed is tested.
    """
    found = []
    for rig, group in rows[rows["place"] == "healthy"].groupby("rig", sort=False):
        half = group.groupby("recording")["second"].transform("max") / 2
        early = group[group["second"] < half]
        late = group[group["second"] >= half]
        alarms = [
            _alarms(group[group["rpm"] != rpm], group[group["rpm"] == rpm], rate)
            for rpm in group["rpm"].unique()
        ]
        races = rows[(rows["rig"] == rig) & rows["place"].isin(_RACES)]
        found.append(
            {
                "rig": rig,
                "healthy stretches": len(group),
                "alarms, same speeds": _alarms(early, late, rate),
                "alarms, speed left out": np.mean(alarms),
                "alarms without reference": _alarms(None, group, rate),
                "races detected": _alarms(early, races, rate),
                "area under the curve": area_under_curve(
                    races[list(FAULT_LOCATIONS)].max(axis=1),
                    group[list(FAULT_LOCATIONS)].max(axis=1),
                ),
            }
        )
    return pd.DataFrame(found)


def _alarms(reference, tested, rate):
    fitted = FaultOrderClassifier(
        bearing="6205", sampling_rate=1e3, false_alarm_rate=rate
    )
    fitted.fit(np.ones((1, 9)))
    if reference is not None:
        fitted._set_healthy(
            reference[list(FAULT_LOCATIONS)].to_numpy(), reference["rpm"].to_numpy()
        )
    found = _matched(tested[list(FAULT_LOCATIONS)].to_numpy(), tested["rpm"].to_numpy())
    return fitted._judge(found).alarm.mean()


def _matched(scores, rpm):
    """Return matches as `FaultOrderClassifier.match` returns them, from stored scores."""
    nothing = np.zeros(scores.shape, dtype=int)
    return Bunch(scores=scores, rpm=rpm, factors=nothing + 1.0, bearings=nothing)


def blocks(recorded, seconds, chosen):
    """Return the Markdown blocks of the page by name."""
    ours = recorded[recorded["method"] == _OURS]
    found = {
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
        found["settings"] = (
            f"{len(_SETTINGS)} settings were scored. For each rig, the settings that are best on "
            "the mean of all other rigs: weights of the contrasts (bands : prewhitened : "
            "prewhitened, long segments), weight of the cage, and slip. The mean of the column "
            f"is {chosen['right'].mean():.3f}.\n\n" + markdown(chosen)
        )
    return {BLOCK.format(name): text for name, text in found.items()}


def cost_of_one_second():
    """Return milliseconds of processor time for 1 s at 51.2 kHz."""
    samples = np.random.default_rng(0).normal(size=51_200)
    orders = np.array([0.4, 2.36, 5.4, 3.6])
    times = []
    for _ in range(20):
        clock = process_time()
        fault_comb(order_contrast(samples, 3000.0, 51_200.0), orders, 0.1, 0.03)
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
    chosen = settings_left_out(rigs) if options.settings else None
    if options.null:
        healthy = seconds[seconds["place"] == "healthy"]
        location, scale = gumbel_r.fit(healthy[list(FAULT_LOCATIONS)].max(axis=1))
        print(f"healthy stretches: location {location:.3f}, scale {scale:.3f} nepers")
    if options.visible:
        ours = recorded[recorded["method"] == _OURS]
        print(visible_left_out(ours, seconds).to_string(index=False))
    print(f"1 s at 51.2 kHz: {cost_of_one_second():.1f} ms")
    publish(options, blocks(recorded, seconds, chosen))
