"""Print what a saved model is, what it was calibrated on, and what it cannot do."""

import argparse
import json
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sklearn.pipeline import Pipeline

from .._answers import answers, unfolded_steps
from .._state import estimators_within
from .._version import __version__
from ..fault_classifier import FaultOrderClassifier
from ..kernels.ladder import rows_that_hold
from .messages import counted
from .models import SavedModel

_UNKNOWN = "not stated"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = __doc__
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="file that fit has saved")
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    model = SavedModel(args.model)
    if args.json:
        print(json.dumps(model.summary | model.facts | {"limits": [*limits(model)]}))
        return 0
    card = model_card(model)
    width = max(map(len, card)) + 2
    layout = {"break_long_words": False, "break_on_hyphens": False}
    for name, text in card.items():
        print(textwrap.fill(f"{name:<{width}}{text}", 100, subsequent_indent=" " * width, **layout))
    print("Limits")
    for sentence in limits(model):
        print(textwrap.fill(sentence, 100, initial_indent="  - ", subsequent_indent="    "))
    return 0


def model_card(model: SavedModel) -> dict[str, str]:
    """Return names and texts of all that is known of a model."""
    facts, rate, steps = model.facts, model.sampling_rate, _steps(model.diagnoser)
    rows = facts.get("rows") or "windows"
    decide = unfolded_steps(model.detector or model.diagnoser)[-1][1]
    conditions = list(map(str, model.conditions))
    if facts.get("n_windows"):
        counts = zip(conditions, facts["n_recordings"], facts["n_windows"], strict=True)
        conditions = [
            f"{name} ({counted(n_recordings, 'recordings')}, {counted(n_windows, rows)})"
            for name, n_recordings, n_windows in counts
        ]
    channels = f" ({', '.join(facts['channels'])})" if facts.get("channels") else ""
    seconds = "" if rate is None else f", {model.window_length / rate:.3g} s"
    card = {
        "Model": str(model.path),
        "Diagnoser": steps if steps.startswith(f"{model.kind} ") else f"{model.kind}: {steps}",
        "Conditions": ", ".join(conditions),
        "Healthy": _UNKNOWN if model.healthy is None else str(model.healthy),
        "Speeds": _speeds(model),
        "Window": f"{model.window_length} samples{seconds}",
        "Sampling rate": _UNKNOWN if rate is None else f"{rate:g} Hz",
        "Channels": f"{model.n_channels}{', the output first' * (model.n_channels > 1)}{channels}",
    }
    if facts.get("false_alarm_rate"):
        card["False alarms"] = f"a rate of {facts['false_alarm_rate']:g} was asked for"
    if model.known is not None:
        rejected = answers(model.known).stated_rate
        card["p-values"] = f"a recording is none of its conditions if they are below {rejected:g}"
    if model.healthy is not None and answers(decide).alarm:
        card["Healthy limits"] = limits_basis(decide, rows)
    versions = [f"{name} {facts[name]}" for name in ("skarxlag", "scikit-learn") if name in facts]
    saved = f" on {facts['saved']}" if facts.get("saved") else ""
    return card | {"Saved by": ", ".join(versions) + saved}


def limits(model: SavedModel) -> Iterator[str]:
    """Yield sentences on what a model cannot do."""
    facts, can = model.facts, model.can
    is_detector = can.conditions is None
    if is_detector:
        yield "It distinguishes healthy from faulty and names no fault."
    else:
        yield (
            "It names the most similar of its conditions. A fault that it was not trained on gets "
            "one of these names, too."
        )
        if model.known is not None:
            yield "The p-value reveals most such faults at the training speeds, and few at others."
    if model.train_rpm is None:
        yield "Its training speeds are not known."
    elif not is_detector:
        yield (
            f"It can recognise conditions at other speeds than {_speeds(model)}. Its confidence "
            "and its detection threshold hold at these speeds only."
        )
    if not is_detector and not can.alarm:
        yield "It has no detection threshold, so it raises no alarm."
    if is_detector and len(can.speeds) < 2:
        yield (
            "It was calibrated at one speed, or without speeds: at other speeds, healthy windows "
            "may raise alarms."
        )
    if facts.get("n_windows") and facts.get("false_alarm_rate"):
        yield from too_few_rows(facts["n_windows"][0], facts["false_alarm_rate"])
    if model.sampling_rate is None:
        yield "The sampling rate of recordings cannot be checked."
    if facts.get("skarxlag") != __version__:
        yield f"Another version of skarxlag saved it; this is {__version__}."


def too_few_rows(n_rows: int, rate: float, rows: str = "windows") -> Iterator[str]:
    """Yield a sentence if n healthy rows are too few for a false-alarm rate.

    A further healthy row exceeds all n with probability 1 / (n + 1), so no threshold that rests on
    the n rows holds a lower rate.

    >>> print(*too_few_rows(4, 0.01))
    4 healthy windows are too few for a false-alarm rate of 0.01. With 4 windows, the lowest rate is
    1/5 = 0.2. Use at least 99.
    >>> list(too_few_rows(99, 0.01))
    []
    """
    needed = rows_that_hold(rate)
    if n_rows < needed:
        yield (
            f"{n_rows} healthy {rows} are too few for a false-alarm rate of {rate:g}. With "
            f"{n_rows} {rows}, the lowest rate is 1/{n_rows + 1} = {1 / (n_rows + 1):.2g}. Use at "
            f"least {needed}."
        )


def limits_basis(decide: Any, rows: str) -> str:
    """Describe the basis of an alarm: the last step of a detector or of a diagnoser."""
    if isinstance(decide, FaultOrderClassifier) and decide.conditions_ is not None:
        decide = decide.conditions_[-1]
    if isinstance(decide, FaultOrderClassifier):
        return f"combs {decide.limit_:.2f} nepers above the healthy {rows}"
    if not answers(decide).healthy_p_value:
        return f"the detection threshold {decide.detection_threshold_:.4g}"
    shares = zip(decide.speeds_, decide.left_out_rates_, strict=False)
    listed = ", ".join(f"{share:.1%} at {speed:g} rpm" for speed, share in shares)
    left_out = f"; false alarms at speeds that were left out: {listed}" if listed else ""
    return f"{decide.n_rows_} healthy {rows}{left_out}"


def _steps(diagnoser):
    # A CalibratedClassifierCV holds the pipelines of its folds, which have the same steps.
    names = [type(step).__name__ for _, step in diagnoser.steps]
    for part in estimators_within(diagnoser[-1]):
        if isinstance(part, Pipeline):
            names[-1] += f" of {_steps(part)}"
            break
    return " -> ".join(names)


def _speeds(model):
    if not model.train_rpm:
        return _UNKNOWN
    return ", ".join(f"{speed:g}" for speed in model.train_rpm) + " rpm"
