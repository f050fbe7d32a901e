"""Print what a saved model is, what it was calibrated on, and what it cannot do.

Of a recording, print its channels with their sampling rates, units and shaft speeds.
"""

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
from ..detection import few_rows
from ..fault_classifier import FaultOrderClassifier
from ..fusion import SensorFusion
from ..recordings.files import list_channels
from ..recordings.listing import ListedRecording
from .messages import as_command_error
from .models import SavedModel, is_model_file

#: Paths are not broken.
_LAYOUT = {"break_long_words": False, "break_on_hyphens": False}
#: Units of facts.
_UNITS = {"train_rpm": "rpm", "sampling_rate": "Hz", "window_length": "samples"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = __doc__
    text = "file that fit has saved, or a recording"
    parser.add_argument("model", type=Path, metavar="FILE", help=text)
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.model.suffix != ".skops" and args.model.is_file() and not is_model_file(args.model):
        return _describe_recording(args)
    model = SavedModel(args.model)
    sentences = list(limits(model))
    if args.json:
        print(json.dumps(model.summary | {"limits": sentences}))
        return 0
    for name, text in model_card(model).items():
        print(_wrapped(f"{name:<22}", text))
    print("Limits")
    for sentence in sentences:
        print(_wrapped("  - ", sentence))
    return 0


def _describe_recording(args):
    with as_command_error():
        channels = list_channels(args.model)
        rpm = ListedRecording(None, args.model.name, args.model).with_speed().rpm
    rows = channels.astype(object).where(channels.notna(), None)
    if args.json:
        print(
            json.dumps({"file": str(args.model), "rpm": rpm, "channels": rows.to_dict("records")})
        )
        return 0
    speed = "not stated" if rpm is None else f"{rpm:g} rpm"
    print(rows.fillna("-").to_string(), f"Shaft speed: {speed}", sep="\n")
    return 0


def _wrapped(head, text):
    indent = " " * len(head)
    return textwrap.fill(text, 100, initial_indent=head, subsequent_indent=indent, **_LAYOUT)


def model_card(model: SavedModel) -> dict[str, str]:
    """Return names and texts of all that is known of a model."""
    facts = {"model": model.path, "steps": _steps(model.diagnoser)} | model.facts
    limited = model.detector or model.diagnoser
    if model.healthy is not None and answers(limited).alarm:
        facts["healthy_limits"] = limits_basis(limited, model.rows)
    return {name.replace("_", " "): _fact_text(name, value) for name, value in facts.items()}


def _fact_text(name, value):
    if value in (None, []):
        return "not stated"
    values = value if isinstance(value, list) else [value]
    texts = (f"{each:g}" if isinstance(each, float) else str(each) for each in values)
    return f"{', '.join(texts)} {_UNITS.get(name, '')}".rstrip()


def limits(model: SavedModel) -> Iterator[str]:
    """Yield sentences on what a model cannot do."""
    facts, can, is_detector = model.facts, model.can, model.can.conditions is None
    cases = {
        "It distinguishes healthy from faulty and names no fault.": is_detector,
        "It names the most similar of its conditions. A fault that it was not trained on gets one "
        "of these names, too.": not is_detector,
        "The p-value reveals most such faults at the training speeds, and few at others.": (
            model.known is not None
        ),
        "Its training speeds are not known.": not model.train_rpm,
        "It can recognise conditions at other speeds than those of the training. Its confidence "
        "and its detection threshold hold at these speeds only.": (
            model.train_rpm and not is_detector
        ),
        "It has no detection threshold, so it raises no alarm.": not (is_detector or can.alarm),
        "It was calibrated at one speed, or without speeds: at other speeds, healthy windows may "
        "raise alarms.": is_detector and len(can.speeds) < 2,
        "The sampling rate of recordings cannot be checked.": model.sampling_rate is None,
        f"Another version of skarxlag saved it; this is {__version__}.": (
            facts.get("skarxlag") != __version__
        ),
    }
    yield from (sentence for sentence, holds in cases.items() if holds)
    if facts.get("n_windows") and facts.get("false_alarm_rate"):
        n_healthy = facts["n_windows"][0]
        rows = f"{n_healthy} healthy {model.rows}"
        yield from few_rows(rows, n_healthy, facts["false_alarm_rate"] / can.n_outputs)


def limits_basis(model: Any, rows: str) -> str:
    """Describe the basis of the alarm of a detector or of a diagnoser."""
    decide = unfolded_steps(model)[-1]
    if isinstance(decide, SensorFusion):
        return f"{limits_basis(decide.estimators_[0], rows)}, for the first output"
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
    steps = unfolded_steps(diagnoser)
    text = " -> ".join(type(step).__name__ for step in steps)
    # A CalibratedClassifierCV holds the pipelines of its folds, which have the same steps.
    inner = [part for part in estimators_within(steps[-1]) if isinstance(part, Pipeline)]
    return f"{text} of {_steps(inner[0])}" if inner else text
