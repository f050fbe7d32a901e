"""Run ``skarxlag evaluate``: compare the diagnosers on a rig or on recordings of a table."""

import argparse
from collections import Counter
from importlib.util import find_spec
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed, parallel_config
from numpy.typing import NDArray
from scipy.signal import welch
from sklearn.base import clone
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.preprocessing import scale
from sklearn.utils import Bunch

from ..accuracy_tables import confusion_table, speed_summary
from ..core.capabilities import offers, requests
from ..core.files import write_atomically
from ..datasets import FETCHERS, simulate_rig
from ..diagnosers import make_diagnoser
from ..kernels.speed_references import group_speeds
from ..model_selection import first_and_second_half
from ..plotting import SpeedAccuracyDisplay
from ..recordings.cutting import cut_recordings
from ..recordings.rows import speeds_of_samples
from . import messages, protocols
from .messages import UsageError, as_command_error, counted, listed
from .models import DIAGNOSERS, of_outputs
from .parsers.evaluate import N_SAMPLES, TITLES
from .progress_bar import ProgressBar

#: The simulated rig: crack sizes, and the speed of the calibration.
_CRACKS_MM, _SIMULATED_RPM = (3.0, 6.0), 500.0
#: Windows of a table are long if every recording holds two of them. Those of a rig are
#: short.
_LONG, _SHORT = 4800, 1200
_QUESTION = (
    "How often does each method name the right condition and the right fault location\n"
    "at a speed, on a bearing or under a load that its training did not have?"
)
#: Explanations of the columns of the summary.
_LEGEND = (
    "bearings: how many were tested; condition, location: windows with the right one, in %;\n"
    "*: the best of a test."
)
_LEGEND_OF_STATED = (
    f"stated: windows whose location has a probability of {protocols.STATED:g} or more, in %; "
    "of these: right ones."
)
#: Titles of protocols across speeds: of a rig, and of the recordings of a table.
_HALVES = {
    "speeds": "trained on first halves at one speed (rows), tested on second (columns)"
}
_SPEEDS = {
    "in": "trained at one speed, tested at all others (columns)",
    "out": "trained at all speeds but one, tested at that (columns)",
}
_CAMPAIGNS = " Training and test differ in recording and campaign."
_NO_CAMPAIGNS = " No column campaign: without remounting, the accuracy may be too high."


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    is_rig = args.table is None
    texts = []
    missing = why_no_figures()
    with as_command_error():
        cases = list(_rig_cases(args)) if is_rig else [_own_case(args)]
        args.output.mkdir(parents=True, exist_ok=True)
        progress = messages.Progress(sum(len(case.methods) for case in cases), args)
        bar = ProgressBar(_work(cases), args)
        summaries = []
        for case in cases:
            verdicts = _verdicts(case, args.n_jobs, progress, bar)
            across_speeds = verdicts[verdicts["protocol"].isin(case.protocols)]
            tables = _tables(case, across_speeds)
            summaries.append(protocols.summary(verdicts))
            texts += [_block(case.title, *block) for block in tables.values()]
            if missing is None:
                _save_figure(case, across_speeds, args.output)
            tables["verdicts"] = "", verdicts
            tables["protocols"] = "", summaries[-1]
            for name, (_, table) in tables.items():
                content = table.to_csv(float_format="%.6g").encode()
                write_atomically(args.output / f"{case.stem}_{name}.csv", content)
            bar.advance("tables", len(case.data))
        stem = args.rig if is_rig else cases[0].stem
        summary = _summary(cases, summaries)
        texts = [summary, "", *texts]
        write_atomically(args.output / f"{stem}_report.txt", "\n".join(texts).encode())
        bar.clear()
    # A summary whose tables cannot be written is not printed.
    print(summary, flush=True)
    print(missing or "Drawn as PNG: accuracy and confusion matrices.")
    print(f"Report, tables and figures are in {args.output.resolve()}")
    return 0


def why_no_figures() -> str | None:
    """Return why no figures can be drawn, or None if they can."""
    if find_spec("matplotlib") is None:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def _work(cases):
    """Return the rows that each diagnoser is fitted on and tested with, and those in tables."""
    work: Counter[str] = Counter()
    for case in cases:
        n_rows = sum(len(train) + len(test) for train, test, *_ in case.splits)
        work.update(dict.fromkeys(case.methods, n_rows))
        work["tables"] += len(case.data)
    return work


def _rig_cases(args):
    """Yield the cases of a rig: one for each crack size of the simulated rig.

    A case is a rig with further entries: ``title``; ``part``, what distinguishes it
    from other cases of the same rig; ``stem`` of its files; ``splits``,
    which are the rows of a training and of its test, the protocol, and the speed of the
    training if there is one; ``methods``, the diagnosers to compare; ``spectra``, the
    rows of those that take spectra instead of windows, by name; ``recommended``, the
    name of one of them; ``protocols``, the titles of those across speeds; ``sentences``
    on what is not measured; and ``note``, a sentence on the recordings of a table.
    """
    length = args.window_length or _SHORT
    messages.report_progress(args, f"{TITLES[args.rig]}: loading")
    if args.rig in FETCHERS:
        rig = FETCHERS[args.rig](data_home=args.data_home, window_length=length)
        yield _rig_case(args, "", args.rig, rig, "all")
        return
    # A tail that fills no window is not simulated.
    n_samples = max((args.n_samples or N_SAMPLES) // length, 1) * length
    for crack in _CRACKS_MM:
        rig = simulate_rig(crack_mm=crack, n_samples=n_samples, window_length=length)
        part = f"crack {crack:g} mm"
        stem = f"{args.rig}_{crack:g}mm"
        yield _rig_case(args, part, stem, rig, _SIMULATED_RPM)


def _rig_case(args, part, stem, rig, train_rpm):
    if np.unique(rig.recording, return_counts=True)[1].min() < 2:
        length = f"argument --window-length: {rig.data.shape[-1]}"
        raise UsageError(f"{length}, expected at most half of the shortest recording")
    speeds = np.unique(rig.rpm).tolist()
    chosen = args.train_rpm or train_rpm
    if chosen not in (*speeds, "all"):
        raise UsageError(
            f"argument --train-rpm: {chosen:g}, expected {listed(speeds)}, or all"
        )
    first, second = first_and_second_half(rig.recording)
    splits = [
        (
            np.flatnonzero(first & (rig.rpm == rpm)),
            np.flatnonzero(second),
            "speeds",
            rpm,
        )
        for rpm in (speeds if chosen == "all" else [chosen])
    ]
    methods = {
        name: make(healthy=rig.target_names[0]) for name, make in DIAGNOSERS.values()
    }
    case = {
        "title": ", ".join(filter(None, [TITLES[args.rig], part])),
        "part": part,
        "stem": stem,
        "methods": methods,
        "note": "",
        "protocols": _HALVES,
    }
    case |= {"recommended": DIAGNOSERS["diagnoser"][0], "spectra": {}}
    usable = np.ones(len(rig.target), dtype=bool)
    further, case["sentences"] = _further_splits(rig, usable, halves=True)
    if chosen != "all":
        further = [
            split for split in further if split[2] == "load" or split[3] == chosen
        ]
    return Bunch(**{"speeds": rig.rpm} | rig | case, splits=splits + further)


def _further_splits(rig, usable, halves):
    """Return the splits that leave bearings and loads out, and what is not measured."""
    bearings, on_bearings = protocols.bearing_splits(rig, usable, halves)
    loads, on_loads = protocols.load_splits(rig, usable)
    return bearings + loads, on_bearings + on_loads


def _own_case(args):
    """Return the case of a table.

    Recordings that are tested are never those of the training. If the table has a
    column ``campaign``, neither are their campaigns: recordings between which nothing
    was remounted.
    """
    recordings = args.listed
    try:
        rig = cut_recordings(recordings, args.table, args.window_length or _LONG)
    except ValueError:
        if args.window_length is not None:
            raise
        rig = cut_recordings(recordings, args.table, _SHORT)
    if rig.target is None or rig.rpm is None:
        raise UsageError(f"{args.table}: needs the columns condition and rpm")
    speeds, errors = speeds_of_samples(rig)
    if rig.profiles:
        # Recordings of varying speed are left out by their mean speed.
        mean = pd.Series(rig.rpm).groupby(rig.recording).transform("mean")
        log_speeds, at = group_speeds(np.log(mean.to_numpy()))
        rig.rpm = np.exp(log_speeds).round(1)[at]
    splits = list(_own_splits(rig, errors == ""))
    if not splits or len(rig.target_names) < 2:
        raise UsageError(f"{args.table}: {_why_no_split(rig)}")
    diagnoser = make_diagnoser(sampling_rate=float(rig.sampling_rate))
    methods = {
        "make_diagnoser": of_outputs(args, diagnoser),
        "log spectrum + LDA": LinearDiscriminantAnalysis(),
        "band energies + forest": RandomForestClassifier(random_state=0),
    }
    # Spectra do not depend on the training, so all tests share them.
    spectra = {
        "log spectrum + LDA": log_spectrum(rig.data, nperseg=256),
        "band energies + forest": log_spectrum(rig.data, nperseg=64),
    }
    note = _CAMPAIGNS if "campaign" in rig.further else _NO_CAMPAIGNS
    case = {
        "title": str(args.table),
        "part": "",
        "stem": args.table.resolve().stem,
        "speeds": speeds,
    }
    case |= {"methods": methods, "recommended": "make_diagnoser", "protocols": _SPEEDS}
    case["spectra"] = spectra
    further, case["sentences"] = _further_splits(rig, errors == "", halves=False)
    return Bunch(**rig | case, splits=splits + further, note=note)


def _why_no_split(rig):
    """Return what a table has, and what it needs so that a speed or campaign can be left out."""
    n_conditions = len(rig.target_names)
    n_speeds = len(np.unique(rig.rpm))
    if "campaign" not in rig.further or min(n_conditions, n_speeds) < 2:
        present = (
            f"{counted(n_conditions, 'condition')} at {counted(n_speeds, 'speed')}"
        )
        return f"{present}; expected at least two of each, and that a speed can be left out"
    campaigns = np.unique(rig.further["campaign"].to_numpy(dtype=str)).tolist()
    present = f"{counted(len(campaigns), 'campaign')} ({', '.join(campaigns[:5])})"
    return (
        f"{present}; expected at least two, and all conditions in the others if one is left out. "
        "Without the column campaign, the accuracy may be too high"
    )


def _own_splits(rig, usable):
    """Yield the splits of both protocols, without those whose training lacks a condition."""
    parts = [(True, True)]
    if "campaign" in rig.further:
        campaign = rig.further["campaign"].loc[rig.recording].to_numpy(dtype=str)
        parts = [(campaign != name, campaign == name) for name in np.unique(campaign)]
    for protocol, speed, (learned, tested) in product(
        ["in", "out"], np.unique(rig.rpm), parts
    ):
        at_speed = rig.rpm == speed
        is_train = at_speed if protocol == "in" else ~at_speed
        train = np.flatnonzero(is_train & learned & usable)
        test = np.flatnonzero(~is_train & tested & usable)
        if len(test) > 0 and len(set(rig.target[train])) == len(rig.target_names):
            yield train, test, protocol, float(speed) if protocol == "in" else np.nan


def log_spectrum(X: NDArray[Any], nperseg: int) -> NDArray[Any]:
    """Compute the log power spectrum of the output at unit RMS, by Welch's method.

    Parameters
    ----------
    X : ndarray of shape (n_windows, n_samples) or (n_windows, n_channels, n_samples)
        Windows.
    nperseg : int
        Samples in a segment; there are half as many bands.
    """
    y = scale(X if X.ndim == 2 else X[:, 0], axis=1)
    return np.log(welch(y, nperseg=nperseg, axis=1)[1][:, 1:] + np.finfo(float).tiny)


def _verdicts(case, n_jobs, progress, bar):
    """Return a row for each window of each test, and each diagnoser."""
    frames = []
    task = delayed(_test)
    for name, diagnoser in case.methods.items():
        with parallel_config("threading", n_jobs=n_jobs):
            parallel = Parallel(return_as="generator")
            X = case.spectra.get(name, case.data)
            tested = parallel(
                task(clone(diagnoser), X, case, *split[:2]) for split in case.splits
            )
            for number, (frame, split) in enumerate(
                zip(tested, case.splits, strict=True)
            ):
                facts = {"split": number, "protocol": split[2], "train_rpm": split[3]}
                frames.append(frame.assign(diagnoser=name, **facts))
                bar.advance(name, len(split[0]) + len(split[1]))
        bar.clear()
        progress.step(f"{case.title}: {name}")
        bar.show()
    verdicts = pd.concat(frames)
    rows = pd.DataFrame({name: case[name] for name in ("rpm", "recording", "start")})
    rows["specimen"] = case.get("specimen", case.target)
    return verdicts.join(rows.rename(columns={"rpm": "test_rpm"})).reset_index(
        drop=True
    )


def _test(diagnoser, X, case, train, test):
    """Fit a diagnoser on some rows of X, and return its verdicts on others."""
    params = {"rpm": case.speeds, "specimen": case.get("specimen")}
    given = {name: value for name, value in params.items() if value is not None}

    def of_rows(method, rows):
        return {
            name: given[name][rows]
            for name in given
            if requests(diagnoser, method, name)
        }

    diagnoser.fit(X[train], case.target[train], **of_rows("fit", train))
    tested = X[test]
    metadata = of_rows("predict", test)
    if offers(diagnoser, "diagnose"):
        diagnosis = diagnoser.diagnose(tested, **metadata)
        predicted = diagnosis.verdict
        probability = diagnosis.probability
    else:
        predicted = diagnoser.predict(tested)
        probability = diagnoser.predict_proba(tested)
    true = case.target[test]
    columns = protocols.location_columns(true, diagnoser.classes_, probability)
    return pd.DataFrame({"true": true, "predicted": predicted, **columns}, index=test)


def _tables(case, verdicts):
    """Return titles and tables by the names of their files."""
    tables = {}
    names = verdicts["diagnoser"].unique()
    units = {"windows": verdicts}
    if case.note:
        # The verdict of most windows of each recording.
        keys = [
            "protocol",
            "diagnoser",
            "split",
            "train_rpm",
            "test_rpm",
            "recording",
            "true",
        ]
        groups = verdicts.groupby(keys, sort=False, dropna=False)["predicted"]
        units["recordings"] = groups.agg(
            lambda group: group.mode().iloc[0]
        ).reset_index()
    for (protocol, title), (unit, frame) in product(
        case.protocols.items(), units.items()
    ):
        tests = frame[frame["protocol"] == protocol]
        hits = tests.assign(hit=100.0 * (tests["true"] == tests["predicted"]))
        index = ["diagnoser"] if case.note else ["diagnoser", "train_rpm"]
        table = hits.pivot_table("hit", index, "test_rpm", sort=False).sort_index(
            axis=1
        )
        if case.note:
            table["mean"] = table.mean(axis=1)
        tables[f"{protocol}_{unit}"] = f"accuracy of {unit} in %, {title}", table
    if not case.note:
        summary = pd.DataFrame(
            {name: speed_summary(table.loc[name]) for name in names}
        ).T
        heading = "mean accuracy in % by pair of speeds"
        tables["summary"] = heading, summary.rename_axis("diagnoser")
    chosen, which = _of_confusions(case, frame)
    for name in names:
        heading = f"confusion matrix of {unit}, {name}, {which}; rows: true "
        heading += "condition, columns: verdict, corner: accuracy in %"
        matrix = confusion_table(chosen[chosen["diagnoser"] == name], case.target_names)
        tables[f"confusion_{'-'.join(name.lower().split())}"] = heading, matrix
    return tables


def _of_confusions(case, verdicts):
    """Return the rows of one protocol at other speeds than that of the training, and their title.

    The last protocol trains on most recordings. If there are no other speeds, all rows
    count.
    """
    protocol, title = list(case.protocols.items())[-1]
    verdicts = verdicts[verdicts["protocol"] == protocol]
    if case.note:
        return verdicts, title.removesuffix(" (columns)")
    other = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    return (
        (other, "tests at other speeds")
        if len(other)
        else (verdicts, "tests at the same speed")
    )


def _summary(cases, summaries):
    """Return the question, the data, one table of all cases, and sentences that read it."""
    first = cases[0]
    names = first.target_names
    speeds = listed(np.unique(first.rpm))
    conditions = f"{counted(len(names), 'condition')} ({', '.join(names)})"
    rate = f"{first.data.shape[-1]} samples at {first.sampling_rate:g} Hz"
    title = first.title.removesuffix(f", {first.part}")
    parts = [case.part for case in cases]
    table = summaries[0] if parts == [""] else pd.concat(summaries, keys=parts)
    legend = [_LEGEND]
    if table["of these"].notna().any():
        legend.append(_LEGEND_OF_STATED)
    else:
        table = table.drop(columns=["stated", "of these"])
    sentences = []
    for case, summary in zip(cases, summaries, strict=True):
        read = [
            protocols.reading(summary, case.recommended),
            *protocols.better_ones(summary, case.recommended),
        ]
        start = f"{case.part.capitalize()}: " if case.part else ""
        sentences += [f"{start}{sentence}" for sentence in read]
    sentences += dict.fromkeys(
        sentence for case in cases for sentence in case.sentences
    )
    return "\n".join(
        [
            _QUESTION,
            "",
            f"{title}: {conditions}",
            f"at {speeds} rpm, windows of {rate}.{first.note}",
            "",
            protocols.with_marks(table),
            *legend,
            "",
            *sentences,
            "",
        ]
    )


def _block(case, title, table):
    shown = (
        table.round(1)
        .rename(columns=_speed)
        .rename_axis(columns=None)
        .rename(index=_speed)
    )
    return (
        f"{case}: {title}\n{shown.to_string(float_format='{:g}'.format, na_rep='-')}\n"
    )


def _speed(name):
    return f"{name:g} rpm" if isinstance(name, float) else name


def _save_figure(case, verdicts, folder):
    """Draw the accuracy across speeds and the confusion matrices of a case, and save them."""
    from matplotlib.figure import Figure
    from sklearn.metrics import ConfusionMatrixDisplay

    names = verdicts["diagnoser"].unique()
    chosen, which = _of_confusions(case, verdicts)
    figure = Figure(figsize=(4.6 * len(names), 9.6), layout="constrained")
    figure.suptitle(f"{case.title}; matrices of windows: {which}", fontsize="medium")
    axes = figure.subplots(2, len(names), sharey="row", squeeze=False)
    style = {"xticks_rotation": "vertical", "cmap": "Blues", "colorbar": False}
    style["labels"] = case.target_names
    for upper, lower, name in zip(*axes, names, strict=True):
        at_speeds = verdicts[verdicts["diagnoser"] == name].dropna(subset="train_rpm")
        speeds = {role: at_speeds[role] for role in ("train_rpm", "test_rpm")}
        display = SpeedAccuracyDisplay(
            at_speeds["true"], at_speeds["predicted"], **speeds
        )
        display.plot(ax=upper)
        upper.set_title(name)
        upper.legend(loc="lower right", fontsize="small")
        counted_rows = chosen[chosen["diagnoser"] == name]
        ConfusionMatrixDisplay.from_predictions(
            counted_rows["true"], counted_rows["predicted"], ax=lower, **style
        )
        lower.set_title(
            "Accuracy "
            f"{100 * (counted_rows['true'] == counted_rows['predicted']).mean():.1f} %"
        )
        lower.set(xlabel="Verdict", ylabel="True condition")
        lower.label_outer()
    figure.savefig(folder / f"{case.stem}.png", dpi=120)
