"""``skarxlag info``: what a saved model is, what it was calibrated on, and where its limits are."""

import argparse
import json
import textwrap
from pathlib import Path

from sklearn.pipeline import Pipeline

from .._answers import answers
from .._validation import estimators_within
from .._version import __version__
from .messages import counted
from .models import SavedModel, calibration_basis, held_rate, load_model, stated_facts

_DESCRIPTION = """\
Say what a saved model is: its conditions, speeds, windows, sampling rate and channels, the versions
that saved it, its calibration, and what must not be expected of it.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="what fit has saved")
    parser.add_argument("--json", action="store_true", help="write JSON, for programs")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    model = load_model(args.model)
    if args.json:
        print(json.dumps(stated_facts(model) | model.facts | {"limits": limits(model)}))
        return 0
    card = model_card(model)
    width = max(map(len, card))
    layout = {"break_long_words": False, "break_on_hyphens": False}
    for name, text in card.items():
        first, further = f"{name:<{width}}  ", " " * (width + 2)
        print(textwrap.fill(text, 100, initial_indent=first, subsequent_indent=further, **layout))
    print("Limits")
    for sentence in limits(model):
        print(textwrap.fill(sentence, 100, initial_indent="  - ", subsequent_indent="    "))
    return 0


def model_card(model: SavedModel) -> dict[str, str]:
    """What is known of a model, as pairs of a name and a text.

    Parameters
    ----------
    model : SavedModel
        The model.

    Returns
    -------
    dict of str to str
        In the order in which it is shown.
    """
    facts, decide = model.facts, model.diagnoser[-1]
    seconds = ""
    if model.sampling_rate is not None:
        seconds = f", {model.window_length / model.sampling_rate:.3g} s"
    card = {
        "Model": str(model.path),
        "Diagnoser": _kind(model),
        "Conditions": ", ".join(_with_counts(model)),
        "Healthy": _or_unknown(model.healthy, "{}"),
        "Speeds": _listed_speeds(model.train_rpm),
        "Window": f"{model.window_length} samples{seconds}",
        "Sampling rate": _or_unknown(model.sampling_rate, "{:g} Hz"),
        "Channels": _channels(model),
    }
    if "false_alarm_rate" in facts:
        card["False alarms"] = f"a rate of {facts['false_alarm_rate']:g} was asked for"
    if model.known is not None:
        rate = answers(model.known).stated_rate
        card["p-values"] = f"a recording is none of its conditions where they are below {rate:g}"
    if answers(decide).healthy_p_value:
        card["Calibration"] = calibration_basis(decide, facts.get("rows", "windows"))
    elif answers(decide).alarm and model.healthy is not None:
        card["Threshold"] = f"{decide.detection_threshold_:.4g}"
    versions = [f"{name} {facts[name]}" for name in ("skarxlag", "scikit-learn") if name in facts]
    card["Saved by"] = ", ".join(versions) + (f" on {facts['saved']}" if "saved" in facts else "")
    return card


def limits(model: SavedModel) -> list[str]:
    """What must not be expected of a model.

    Parameters
    ----------
    model : SavedModel
        The model.

    Returns
    -------
    list of str
        Sentences.
    """
    sentences = []
    can = answers(model.diagnoser)
    is_detector = can.conditions is None
    if is_detector:
        sentences.append("It tells healthy from faulty and names no fault.")
    else:
        sentences.append(
            "It names the most similar of its conditions. A fault that it was not trained on gets "
            "one of these names, too."
        )
        if model.known is not None:
            sentences.append(
                "The p-value tells most such faults at the speeds of the training, and few at "
                "others."
            )
    if model.train_rpm is None:
        sentences.append("The speeds of its training are not known.")
    elif not is_detector:
        sentences.append(
            f"Conditions may be told at other speeds than {_listed_speeds(model.train_rpm)}; its "
            "confidence and its detection threshold hold at these only."
        )
    if not is_detector and not can.alarm:
        sentences.append("It has no detection threshold, so it raises no alarm.")
    if is_detector and len(can.speeds) < 2:
        sentences.append(
            "It was calibrated at one speed, or at speeds that nobody stated: at others healthy "
            "windows may raise alarms."
        )
    if "n_windows" in model.facts and "false_alarm_rate" in model.facts:
        sentences += held_rate(model.facts["n_windows"][0], model.facts["false_alarm_rate"])
    if model.sampling_rate is None:
        sentences.append("Nobody can check the sampling rate of recordings against it.")
    if model.facts.get("skarxlag") != __version__:
        sentences.append(f"This is skarxlag {__version__}, which is not the version that saved it.")
    return sentences


def _kind(model):
    """Its name, where that is not the first of its steps, and its steps."""
    steps = _steps(model.diagnoser)
    return steps if steps.startswith(f"{model.kind} ") else f"{model.kind}: {steps}"


def _steps(diagnoser):
    # A CalibratedClassifierCV holds the pipelines of its folds, which have the same steps.
    last = diagnoser[-1]
    inner = next((part for part in estimators_within(last) if isinstance(part, Pipeline)), None)
    names = [type(step).__name__ for _, step in diagnoser.steps]
    if inner is not None:
        names[-1] += f" of {_steps(inner)}"
    return " -> ".join(names)


def _with_counts(model):
    counts = model.facts.get("n_windows")
    if not counts:
        return map(str, model.conditions)
    recordings = model.facts["n_recordings"]
    rows = model.facts.get("rows", "windows")
    return [
        f"{name} ({counted(n_recordings, 'recordings')}, {counted(n_windows, rows)})"
        for name, n_recordings, n_windows in zip(model.conditions, recordings, counts, strict=True)
    ]


def _listed_speeds(speeds):
    return "not stated" if not speeds else ", ".join(f"{speed:g}" for speed in speeds) + " rpm"


def _channels(model):
    names = model.facts.get("channels")
    listed = "" if not names else f" ({', '.join(names)})"
    return f"{model.n_channels}, the output first{listed}" if model.n_channels > 1 else f"1{listed}"


def _or_unknown(value, form):
    return "not stated" if value is None else form.format(value)
