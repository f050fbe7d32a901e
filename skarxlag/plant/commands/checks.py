"""Checks of the arguments of each command, as far as they need no computation.

A check raises an error if the arguments are wrong, and replaces names of recordings by
the recordings that it has listed.
"""

import os
from argparse import Namespace
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..readers.entries import ListedRecording
from ..readers.listing import is_file_source, list_files, list_recordings
from ..readers.speeds import TACHO
from .files import (
    SUFFIXES,
    check_input,
    check_output,
    is_model_file,
    is_report,
    result_paths,
)
from .messages import CommandError, UsageError, as_command_error, refuse, require

#: Facts of recordings that no table lists.
_FACTS = (
    "pattern",
    "channel",
    "sampling_rate",
    "pulses_per_revolution",
    "dtype",
)


def fit(args: Namespace) -> None:
    """List the recordings, and check the output."""
    if args.bearing is not None and args.diagnoser != "stretches":
        refuse(args, ["diagnoser"], "is stretches with --bearing")
    args.recordings = _table_recordings(args)
    inputs = [args.table, *(recording.path for recording in args.recordings)]
    args.output = check_output(args.output, inputs, args.force)
    require(("skops",), "saving a diagnoser", "io")


def diagnose(args: Namespace) -> None:
    """List the recordings, and check the outputs."""
    path = args.model
    is_recording = path and path.suffix != ".skops" and not is_model_file(path)
    if args.bearing is not None and is_recording:
        args.recordings.insert(0, str(path))
        args.model = None
    if args.model is not None:
        check_input(args.model)
    elif args.bearing is None:
        raise UsageError(
            "argument MODEL.skops: none given, expected a model or --bearing"
        )
    else:
        refuse(args, ["resample"], "belongs to a model")
    outputs = [] if args.output is None else result_paths(args.output)
    # Results of an earlier run may lie in the folder of the recordings.
    results = {path.absolute() for path in outputs}
    results -= {Path(path).absolute() for path in args.recordings}
    args.recordings = [
        recording
        for recording in _named_and_of_table(args)
        if recording.path.absolute() not in results
    ]
    inputs = [args.model, args.table]
    inputs += [recording.path for recording in args.recordings]
    outputs = [check_output(path, inputs, args.force, SUFFIXES) for path in outputs]
    args.output = outputs[0] if outputs else None
    if is_report(args.output):
        require(("jinja2", "matplotlib"), "a report", "io")


def evaluate(args: Namespace) -> None:
    """List the recordings of a table."""
    of_rigs = ["data_home", "where", "channel"]
    if args.table is not None:
        refuse(args, ["dataset", "n_samples"], "not allowed with a table")
        args.recordings = _table_recordings(args)
        of_rigs.remove("channel")
    else:
        of_tables = [name for name in _FACTS if name != "channel"]
        refuse(args, [*of_tables, "rpm", "outputs", "bearing"], "needs a table")
    if args.dataset is None:
        refuse(args, of_rigs, "needs --dataset")
    else:
        refuse(args, ["n_samples"], "belongs to the simulated rig")
    if args.output.exists() and not args.output.is_dir():
        raise UsageError(
            f"argument --output: {args.output} is a file, expected a folder"
        )


def show(args: Namespace) -> None:
    """List the recordings, and check the output."""
    require(("jinja2", "matplotlib"), "a page", "io")
    args.recordings = _named_and_of_table(args)
    if args.output is None:
        args.output = Path(f"{args.recordings[0].path.stem}.html")
    inputs = [recording.path for recording in args.recordings]
    args.output = check_output(args.output, inputs, args.force, (".html",))


def bearings(args: Namespace) -> None:
    """List the recording."""
    paths = [] if args.recording is None else [args.recording]
    args.recordings = _named_recordings(args, paths)
    if len(args.recordings) > 1:
        raise UsageError(
            f"argument RECORDING: {len(args.recordings)} recordings, expected one"
        )


def watch(args: Namespace) -> None:
    """Check the model or the table, and the state."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    if args.latch and args.state is None:
        raise UsageError(
            "argument --latch: needs --state, next to which alarms are acknowledged"
        )
    check_input(args.model)
    if args.state is not None:
        if args.source is None:
            args.state.mkdir(parents=True, exist_ok=True)
        elif not args.state.parent.is_dir():
            raise CommandError(f"{args.state.parent}: no such folder")


def acknowledge(args: Namespace) -> None:
    """Check that the states exist."""
    for path in args.states:
        check_input(path)


def info(args: Namespace) -> None:
    """Check that the file exists."""
    check_input(args.path)


def _stated(args):
    """Return the facts in the arguments, as `list_files` and `list_recordings` take them."""
    if not args.rpm.get("speed_source", "").startswith(TACHO):
        refuse(args, ["pulses_per_revolution"], f"belongs to --rpm {TACHO}CHANNEL")
    facts = {name: getattr(args, name) for name in _FACTS} | args.rpm
    return {name: value for name, value in facts.items() if value is not None}


def _named_recordings(args: Namespace, paths: Iterable[str]) -> list[ListedRecording]:
    """List the recordings of some arguments, also files that do not exist."""
    facts: dict[str, Any] = _stated(args)
    recordings = []
    with as_command_error():
        for path in paths:
            if os.path.exists(path) or is_file_source(path):
                # Two folders may hold files of the same name.
                recordings += [
                    replace(recording, name=str(recording.path))
                    for recording in list_files(path, **facts)
                ]
            else:
                recordings.append(ListedRecording(None, path, Path(path)))
    return recordings


def _named_and_of_table(args):
    """List the recordings of the arguments and of the table, one of which is given."""
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    if not args.recordings:
        return _table_recordings(args)
    recordings = _named_recordings(args, args.recordings)
    if args.table is not None:
        # The facts in the arguments are those of the recordings.
        with as_command_error():
            recordings += list_recordings(args.table)
    return recordings


def _table_recordings(args):
    """List the recordings of a table, a folder or a glob."""
    if not is_file_source(args.table):
        refuse(args, ["pattern"], f"for a folder or a glob; {args.table} is a table")
    with as_command_error():
        return list_recordings(args.table, **_stated(args))
