"""Run ``skarxlag info``: describe a saved model, or the channels of a recording."""

import argparse
import json
from collections.abc import Iterator
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
        table = channels.astype(object).fillna("-").to_string()
        return [table, f"Shaft speed: {speed}"], facts
    model = SavedModel(path)
    steps = (type(step).__name__ for step in unfolded_steps(model.diagnoser))
    facts = model.facts | {
        "model": model.short_identity,
        "steps": " -> ".join(steps),
        "healthy_limits": capabilities(model.detector or model.diagnoser).limits
        or None,
    }
    sentences = [*limits(model), *facts.pop("error_rates", [])]
    lines = [_line(*fact) for fact in facts.items()]
    lines += ["Limits", *(f"  - {sentence}" for sentence in sentences)]
    return lines, facts | {"limits": sentences}


def _line(name, value):
    values = value if isinstance(value, list) else [value]
    texts = [f"{v:g}" if isinstance(v, float) else str(v) for v in values]
    text = f"{', '.join(texts)} {_UNITS.get(name, '')}"
    if value in (None, []):
        text = "not stated"
    return f"{name.replace('_', ' '):<22}{text}".rstrip()


def limits(model: SavedModel) -> Iterator[str]:
    """Yield sentences on what a model cannot do."""
    described = model.capabilities
    rate = model.sampling_rate
    if described.conditions is not None:
        yield "It names the most similar of its conditions, also for any other fault."
    else:
        yield "It distinguishes healthy from faulty and names no fault."
        if len(described.speeds) < 2:
            yield "At other speeds, it may raise false alarms."
    if not model.judge.limits.exist:
        yield "It has no healthy limits, so it raises no alarm."
    if rate is None:
        yield "The sampling rate of recordings cannot be checked."
    elif described.compares_orders:
        lowest = 60 * LEAST_REVOLUTIONS * rate / model.window_length
        yield (
            f"It compares no order spectra below {lowest:.3g} rpm: a stretch needs "
            f"{LEAST_REVOLUTIONS} revolutions."
        )
    false_alarm_rate = model.facts.get("false_alarm_rate")
    if model.facts.get("n_windows") and false_alarm_rate:
        n_healthy = model.facts["n_windows"][0]
        rows = f"{n_healthy} healthy {model.rows}"
        yield from too_few_rows(rows, n_healthy, false_alarm_rate / described.n_outputs)
