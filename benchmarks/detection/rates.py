"""False alarms and missed faults of detectors fitted on healthy rows of some speeds.

Run ``python -m benchmarks.detection rates`` from the root of the repository. First
halves of healthy recordings calibrate; second halves of all recordings are scored.
"""

from functools import partial
from time import process_time

import numpy as np
import pandas as pd
from sklearn.metrics import roc_auc_score

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.detection.detectors import PEERS, ours, peer
from benchmarks.detection.rigs import RIGS, find_rig, row_lengths
from benchmarks.pages.blocks import markdown, page_parser, publish

RATES = (0.01, 0.05)
#: If the gain differs between recordings, the level contains no information.
FREE_GAIN = {"SpectraQuest", "self-built"}
SPLITS = {
    "left out": "healthy rows of all other speeds, tested at the one left out",
    "one speed": "healthy rows of one speed, tested at every other",
    "same": "healthy rows of all speeds, tested at these",
}


def splits(speeds):
    """Speeds that calibrate and speeds that are tested, by the kind of the split."""
    for speed in speeds:
        others = speeds[speeds != speed]
        yield "left out", others, [speed]
        yield "one speed", np.array([speed]), others
    yield "same", speeds, speeds


def methods(fixed_gain, *, peers=True):
    """Detectors by name."""
    detectors = {"make_detector": partial(ours, fixed_gain=False)}
    if fixed_gain:
        detectors["make_detector, fixed gain"] = partial(ours, fixed_gain=True)
    if not peers:
        return detectors
    return detectors | {
        name: partial(peer, fixed_gain=fixed_gain, make=make)
        for name, make in PEERS.items()
    }


def detection_rates(rig, row_length, fixed_gain, *, peers=True):
    """One row for each detector, rate, split, tested speed and condition."""
    first, second = first_and_second_half(rig.recording, rig.start, row_length)
    healthy = rig.target == rig.target_names[0]
    seconds_of_signal = row_length / rig.sampling_rate
    rows = []
    for name, calibrate in methods(fixed_gain, peers=peers).items():
        for rate in RATES:
            for split, trained, tested in splits(np.unique(rig.rpm)):
                train = first & healthy & np.isin(rig.rpm, trained)
                clock = process_time()
                score = calibrate(rate, rig.data[train], rig.rpm[train])
                fit_seconds = process_time() - clock
                for speed in tested:
                    test = second & (rig.rpm == speed)
                    clock = process_time()
                    scores = score(rig.data[test], rig.rpm[test])
                    cost = (process_time() - clock) / (test.sum() * seconds_of_signal)
                    auc = roc_auc_score(healthy[test], scores)
                    for condition in rig.target_names:
                        is_condition = rig.target[test] == condition
                        rows.append(
                            {
                                "detector": name,
                                "stated": rate,
                                "split": split,
                                "calibrated at": " ".join(f"{k:g}" for k in trained),
                                "rpm": speed,
                                "condition": condition,
                                "is_healthy": condition == rig.target_names[0],
                                "healthy rows": int(train.sum()),
                                "rows": int(is_condition.sum()),
                                "flagged": float(np.mean(scores[is_condition] < 0)),
                                "auc": auc,
                                "fit_seconds": fit_seconds,
                                "seconds a second": cost,
                            }
                        )
    return pd.DataFrame(rows)


def rates_table(rates):
    """Markdown: false alarms and missed faults in %, at stated rates of 1 and 5 %."""
    lines = []
    for (rig, length, name), group in rates.groupby(
        ["rig", "row", "detector"], sort=False
    ):
        line = {"rig": rig, "row": length, "detector": name}
        for split in SPLITS:
            part = group[group["split"] == split]
            false = []
            missed = []
            for rate in RATES:
                at_rate = part[part["stated"] == rate]
                false.append(
                    f"{100 * at_rate[at_rate['is_healthy']]['flagged'].mean():.0f}"
                )
                missed.append(
                    f"{100 * (1 - at_rate[~at_rate['is_healthy']]['flagged'].mean()):.0f}"
                )
            auc = part["auc"].mean()
            line[split] = f"{'/'.join(false)}, {'/'.join(missed)}, {auc:.3f}"
        lines.append(line)
    return (
        "Stated rates 1 % / 5 %. In each cell: "
        "false alarms in %, missed faults in %, area under the receiver's curve; means over "
        "speeds. "
        + "; ".join(f"*{name}*: {text}" for name, text in SPLITS.items())
        + f".\n\n{markdown(pd.DataFrame(lines))}"
    )


def family_table(rates):
    """Markdown: missed faults of each condition in %, at a stated 1 %."""
    chosen = rates[
        rates["detector"].str.startswith("make_detector")
        & (rates["stated"] == RATES[0])
        & ~rates["is_healthy"]
        & (rates["split"] != "same")
    ]
    lines = []
    for (rig, length, name, split), group in chosen.groupby(
        ["rig", "row", "detector", "split"], sort=False
    ):
        missed = group.groupby("condition", sort=False)["flagged"].mean()
        listed = ", ".join(
            f"{each} {100 * (1 - share):.0f}" for each, share in missed.items()
        )
        lines.append(
            {
                "rig": rig,
                "row": length,
                "detector": name,
                "split": split,
                "missed": listed,
            }
        )
    return f"Missed faults by condition in %, stated rate 1 %.\n\n{markdown(pd.DataFrame(lines))}"


def cost_table(rates):
    """Markdown: processor time."""
    chosen = rates[rates["split"] == "same"]
    lines = [
        {
            "rig": rig,
            "row": length,
            "detector": name,
            "healthy rows": int(group["healthy rows"].iloc[0]),
            "fit, s": group["fit_seconds"].mean(),
            "ms a second of signal": 1e3 * group["seconds a second"].mean(),
        }
        for (rig, length, name), group in chosen.groupby(
            ["rig", "row", "detector"], sort=False
        )
    ]
    return f"Processor time on one core.\n\n{markdown(pd.DataFrame(lines), digits=2)}"


def main(arguments=None):
    parser = page_parser(__doc__, "detection")
    parser.add_argument("--rig", nargs="+", default=list(RIGS), help=f"of {list(RIGS)}")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument(
        "--rows", nargs="+", default=["4800", "1 s"], help="4800 or '1 s'"
    )
    parser.add_argument(
        "--no-peers", action="store_true", help="measure make_detector only"
    )
    chosen = parser.parse_args(arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    frames = []
    for name in chosen.rig:
        for label, length in row_lengths(name).items():
            if label not in chosen.rows:
                continue
            rig = find_rig(name)(length, data_home=chosen.data_home)
            rates = detection_rates(
                rig, length, fixed_gain=name not in FREE_GAIN, peers=not chosen.no_peers
            )
            frames.append(rates.assign(rig=name, row=label))
            pd.concat(frames).to_csv(chosen.output / "rates.csv", index=False)
    rates = pd.concat(frames)
    publish(
        chosen,
        {
            "detection": rates_table(rates),
            "detection families": family_table(rates),
            "detection cost": cost_table(rates),
        },
    )
