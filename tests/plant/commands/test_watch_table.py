"""Several sensors in one process, from a table."""

import json
import os

import numpy as np
import pandas as pd
import pytest

from skarxlag.plant.watch import sensor
from tests.plant.commands.watching import IDLE, expected, lines_of, sound, verdicts_of

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


@pytest.fixture
def plant(models, tmp_path):
    """A table of two logs and of a folder, each of another signal."""
    signals = {"pump 1": sound("good", 700, 3), "pump 2": sound("worn", 900, 4)}
    rows = []
    for number, (name, signal) in enumerate(signals.items()):
        path = tmp_path / f"{number}.csv"
        path.write_bytes(b"other,acc\n" + lines_of(np.stack([-signal, signal])))
        rows.append((name, path.name, models[0], "acc", 900 + number))
    (tmp_path / "fan").mkdir()
    signals["fan"] = sound("good", 450, 5)
    np.save(tmp_path / "fan" / "a.npy", signals["fan"])
    rows.append(("fan", "fan", models[0], "", ""))
    columns = ["name", "source", "model", "channel", "rpm"]
    # Spreadsheets of many countries separate by semicolons.
    pd.DataFrame(rows, columns=columns).to_csv(
        tmp_path / "plant.csv", index=False, sep=";"
    )
    return tmp_path / "plant.csv", signals


def test_each_sensor_has_its_own_verdicts_and_the_model_is_loaded_once(
    run, plant, fitted, monkeypatch
):
    table, signals = plant
    loaded, saved_model = [], sensor.SavedModel

    def load(path):
        loaded.append(path)
        return saved_model(path)

    monkeypatch.setattr(sensor, "SavedModel", load)
    code, out, err = run("watch", table, *IDLE)
    assert code == 0 and len(loaded) == 1
    assert err.splitlines()[2].startswith("pump 1: 700 samples; windows: 3 good; ")
    lines = out.splitlines()
    for name, speed in (("pump 1", 900.0), ("pump 2", 901.0), ("fan", None)):
        of_sensor = [line for line in lines if json.loads(line)["sensor"] == name]
        verdicts = verdicts_of("\n".join(of_sensor))
        for verdict in verdicts:
            assert verdict.pop("source", "a.npy") == "a.npy"
        alone = expected(fitted, signals[name])
        assert verdicts == [verdict | {"rpm": speed} for verdict in alone]


def test_a_later_run_continues_each_sensor(run, plant):
    table, signals = plant
    options = (*IDLE, "--state", table.parent / "states")
    assert len(run("watch", table, *options)[1].splitlines()) == 9
    assert {path.stem for path in (table.parent / "states").iterdir()} == set(signals)
    with (table.parent / "0.csv").open("ab") as file:
        file.write(lines_of(np.stack([np.zeros(150), sound("good", 150, 6)])))
    (line,) = map(json.loads, run("watch", table, *options)[1].splitlines())
    assert (line["sensor"], line["start"]) == ("pump 1", 600)


def test_a_source_that_fails_does_not_end_the_others(run, plant):
    table, _ = plant
    (table.parent / "0.csv").write_bytes(
        b"acc\n" + b"1" * 2**20 + b"\n" * 9 + b"x\n" * 9
    )
    code, out, err = run("watch", table, *IDLE)
    assert code == 1
    watched = {json.loads(line)["sensor"] for line in out.splitlines()}
    assert watched == {"pump 2", "fan"}
    (line,) = (line for line in err.splitlines() if "error" in line)
    assert line.startswith("pump 1: error: ") and "0.csv: " in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: t.drop(columns="model"),
            "3 sensors with the columns name, source, channel, rpm",
        ),
        (
            lambda t: t.assign(speed=1),
            "expected name, source, model, and if needed channel, rpm",
        ),
        (lambda t: t[:0], "0 sensors with the columns"),
    ],
)
def test_a_table_that_is_none_ends_the_command(run, plant, change, message):
    table, _ = plant
    change(pd.read_csv(table, sep=";")).to_csv(table, index=False)
    code, out, err = run("watch", table, *IDLE)
    assert code == 1 and out == "" and message in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("option", "column"), [("--sensor", "name"), ("--rpm-column", "rpm")]
)
def test_an_option_that_a_column_replaces_is_refused(run, plant, option, column):
    code, _, err = run("watch", plant[0], option, "x")
    assert code == 2
    assert f"argument {option}: " in err
    assert f"has a column {column}" in err


def test_a_model_alone_reads_standard_input(run, models, monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        code, out, err = run("watch", models[0])
    assert code == 0 and out == "" and "0 samples" in err
