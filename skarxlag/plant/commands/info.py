"""Run ``skarxlag info``: describe a saved model, or the channels of a recording."""

import argparse
import json
from pathlib import Path
from typing import Any

from ...core.capabilities import capabilities, unfolded_steps
from ...core.speeds import LEAST_REVOLUTIONS
from ...decisions.row_outliers import too_few_rows
from ..readers.entries import ListedRecording
from ..readers.files import list_channels
from .files import is_model_file
from .messages import as_command_error, show
from .models import SavedModel
from .results import records

#: Units of facts.
_UNITS = {"train_rpm": "rpm", "sampling_rate": "Hz", "window_length": "samples"}


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    lines, facts = describe(args.path)
    show(*([json.dumps(facts)] if args.json else lines))
    return 0


def describe(path: Path) -> tuple[list[str], dict[str, Any]]:
    """Describe a saved model, or the channels of a recording: in lines, and as facts.

    Raises
    ------
    CommandError
        If the file cannot be read.
    """
    if path.suffix != ".skops" and not is_model_file(path):
        with as_command_error():
            channels = list_channels(path)
            rpm = ListedRecording(None, path.name, path).with_speed().rpm
        facts = {"file": str(path), "rpm": rpm, "channels": records(channels)}
        speed = "not stated" if rpm is None else f"{rpm:g} rpm"
        lines = [
            channels.astype(object).fillna("-").to_string(),
            f"Shaft speed: {speed}",
        ]
    else:
        model = SavedModel(path)
        limited = model.detector or model.diagnoser
        steps = (type(step).__name__ for step in unfolded_steps(model.diagnoser))
        further = {"model": model.short_identity, "steps": " -> ".join(steps)}
        basis = capabilities(limited).limits
        if model.healthy is not None and basis:
            further["healthy_limits"] = basis
        sentences = limits(model)
        lines = [_line(*fact) for fact in (model.facts | further).items()]
        lines += ["Limits", *(f"  - {sentence}" for sentence in sentences)]
        facts = model.facts | {"model": model.short_identity, "limits": sentences}
    return lines, facts


def _line(name, value):
    values = value if isinstance(value, list) else [value]
    texts = [f"{v:g}" if isinstance(v, float) else str(v) for v in values]
    text = f"{', '.join(texts)} {_UNITS.get(name, '')}"
    if value in (None, []):
        text = "not stated"
    return f"{name.replace('_', ' '):<22}{text}".rstrip()


def limits(model: SavedModel) -> list[str]:
    """Return sentences on what a model cannot do."""
    facts = model.facts
    described = model.capabilities
    names_faults = described.conditions is not None
    cases = {
        "It distinguishes healthy from faulty and names no fault.": not names_faults,
        "It names the most similar of its conditions, also for any other fault.": names_faults,
        "It has no detection threshold, so it raises no alarm.": (
            names_faults and not described.alarm
        ),
        "At other speeds, it may raise false alarms.": (
            len(described.speeds) < 2 and not names_faults
        ),
        "The sampling rate of recordings cannot be checked.": (
            model.sampling_rate is None
        ),
    }
    sentences = [sentence for sentence, holds in cases.items() if holds]
    sentences += _order_limits(model)
    rates = model.error_rates
    if rates is not None:
        seconds = model.window_length / model.sampling_rate
        sentences += rates.sentences(facts["false_alarm_rate"], seconds, facts["rows"])
    if facts.get("n_windows") and facts.get("false_alarm_rate"):
        n_healthy = facts["n_windows"][0]
        rate = facts["false_alarm_rate"]
        sentences += too_few_rows(
            f"{n_healthy} healthy {model.rows}", n_healthy, rate / described.n_outputs
        )
    return sentences


def _order_limits(model):
    """Yield below which speed a stretch is too short for order spectra, or that it always is."""
    if not model.capabilities.compares_orders:
        if (
            model.facts["diagnoser"] == "stretches"
            and not model.capabilities.is_stretch
        ):
            yield "It compares no order spectra, because its stretches are too short."
    elif model.sampling_rate is not None and model.window_length is not None:
        lowest = 60 * LEAST_REVOLUTIONS * model.sampling_rate / model.window_length
        yield (
            f"It compares no order spectra below {lowest:.3g} rpm: a stretch needs "
            f"{LEAST_REVOLUTIONS} revolutions."
        )
