import sys

import numpy as np
import pytest

from skarxlag import make_detector, make_diagnoser, make_windows, save_diagnoser
from skarxlag.plant.commands import main
from tests.plant.watch.watching import COLOURS, RATE, WINDOW, sound, verdicts_of


def counts(out):
    """Recordings and rows of each condition, as fit prints them."""
    rows = [line.split() for line in out.splitlines()]
    rows = [
        row for row in rows if len(row) == 3 and row[1].isdigit() and row[2].isdigit()
    ]
    return {row[0]: [int(row[1]), int(row[2])] for row in rows}


@pytest.fixture
def run(capsys, monkeypatch):
    """Run the command line in this process: exit code, stdout, stderr.

    With `force`, it replaces files that a test wrote before.
    """
    monkeypatch.setattr("skarxlag.plant.watch.sensors._PAUSE", 0.005)
    # A look at a folder may take long while other processes run.
    monkeypatch.setattr("skarxlag.plant.watch.folders._PAUSE", 0)

    def run_command(*argv, force=True):
        # A fixture may have run a command before.
        capsys.readouterr()
        if force and {"-o", "--output"} & {*argv} and argv[0] != "evaluate":
            argv += ("--force",)
        try:
            code = main([str(each) for each in argv])
        except SystemExit as stop:
            code = stop.code
        out, err = capsys.readouterr()
        return code, out, err

    return run_command


@pytest.fixture(scope="session")
def fitted():
    """A diagnoser and a detector of two colours of noise."""
    parts = [make_windows(sound(name, 30 * WINDOW, 1), WINDOW) for name in COLOURS]
    X, y = np.concatenate(parts), np.repeat(list(COLOURS), 30)
    healthy = make_windows(sound("good", 100 * WINDOW, 2), WINDOW)
    return make_diagnoser(healthy="good").fit(X, y), make_detector().fit(healthy)


@pytest.fixture(scope="session")
def models(fitted, tmp_path_factory):
    """Files of the diagnoser with its healthy limits, and of the detector alone."""
    folder = tmp_path_factory.mktemp("models")
    paths = folder / "diagnoser.skops", folder / "detector.skops"
    for model, path, names in zip(
        fitted, paths, (["good", "worn"], ["good"]), strict=True
    ):
        facts = {"conditions": names, "n_channels": 1}
        facts |= {} if model is fitted[1] else {"detector": fitted[1]}
        save_diagnoser(model, path, window_length=WINDOW, sampling_rate=RATE, **facts)
    return paths


@pytest.fixture(scope="session")
def inputs():
    """Files that stood in for standard input. A thread of a test that ended may still read one."""
    opened = []
    yield opened
    for file in opened:
        file.close()


@pytest.fixture
def piped(monkeypatch, tmp_path_factory, inputs):
    """Standard input that holds these bytes."""
    path = tmp_path_factory.mktemp("stdin") / "input"

    def set_input(data):
        path.write_bytes(data)
        inputs.append(path.open())
        monkeypatch.setattr(sys, "stdin", inputs[-1])

    return set_input


@pytest.fixture
def watch(run, models, piped):
    """Watch bytes on standard input: exit code, verdicts and standard error."""

    def watch(data, *options):
        piped(data)
        code, out, err = run("watch", models[0], "-", *options)
        return code, verdicts_of(out), err

    return watch
