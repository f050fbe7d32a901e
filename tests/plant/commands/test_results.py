import json
import os

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio, save_diagnoser
from skarxlag.plant.commands import fit
from skarxlag.plant.commands.models import SavedModel

WINDOW = 200


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, WINDOW))
    X[20:] = lfilter([1.0], [1.0, -0.9], X[20:])
    path = folder / "bearing.skops"
    save_diagnoser(
        make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 20)), path
    )
    return path, X


@pytest.fixture
def plant(saved, tmp_path):
    """A model, a good and a worn recording, a dead sensor, and the table of all."""
    model, X = saved
    (tmp_path / "bearing.skops").write_bytes(model.read_bytes())
    np.save(tmp_path / "good.npy", X[:5].ravel())
    np.save(tmp_path / "worn.npy", X[20:24].ravel())
    np.save(tmp_path / "dead.npy", np.zeros(3 * WINDOW))
    lines = ["path,condition,rpm,sampling_rate,specimen"]
    lines += [f"{name}.npy,{name},300,5e3,B1" for name in ("good", "worn", "dead")]
    lines.append("lost.npy,worn,300,5e3,B2")
    (tmp_path / "table.csv").write_text("\n".join(lines))
    return tmp_path


@pytest.fixture
def diagnose(run, plant):
    """Run `diagnose` with the model."""
    return lambda *arguments, **options: run(
        "diagnose", plant / "bearing.skops", *arguments, **options
    )


READERS = {".csv": pd.read_csv, ".parquet": pd.read_parquet}


@pytest.mark.parametrize("suffix", READERS)
def test_a_row_for_each_recording_and_one_for_each_window(diagnose, plant, suffix):
    output = plant / f"out{suffix}"
    arguments = ("--table", plant / "table.csv", "-o", output)
    code, out, _ = diagnose(*arguments)
    assert code == 1 and str(output) in out
    rows = READERS[suffix](output)
    names = ["good.npy", "worn.npy", "dead.npy", "lost.npy"]
    assert rows["recording"].tolist() == names
    assert rows["verdict"].iloc[:3].tolist() == ["good", "worn", "no signal"]
    assert rows["condition"].tolist() == ["good", "worn", "dead", "worn"]
    assert rows["stated_specimen"].tolist() == ["B1", "B1", "B1", "B2"]
    assert rows["windows"].iloc[:3].tolist() == [5, 4, 3]
    assert rows["no_signal"].iloc[2] == 3
    # The name of the recording has a column of its own.
    assert rows["verdict"].iloc[3] == "no verdict: no such file"
    assert rows["error"].iloc[3] == "no such file"
    assert "constant: 3" in rows["remark"].iloc[2]
    assert "No window carries a signal. Check the sensor" in rows["remark"].iloc[2]
    assert set(rows["healthy"]) == {"good"} and not any(" " in name for name in rows)
    windows = READERS[suffix](plant / f"out_windows{suffix}")
    assert windows["recording"].value_counts().tolist() == [5, 4, 3]
    assert windows["start"].iloc[:5].tolist() == list(range(0, 5 * WINDOW, WINDOW))
    assert (windows["quality"] == "constant").sum() == 3


def test_json_holds_the_windows_of_each_recording(diagnose, plant):
    output = plant / "out.json"
    arguments = ("--table", plant / "table.csv", "-o", output)
    diagnose(*arguments)
    content = json.loads(output.read_text(), parse_constant=pytest.fail)
    assert content["model"]["conditions"] == ["good", "worn"]
    rows = content["recordings"]
    assert [len(row["window_rows"]) for row in rows] == [5, 4, 3, 0]
    assert [row["verdict"] for row in rows][:3] == ["good", "worn", "no signal"]
    assert content["model"]["healthy"] == "good"
    names = {*rows[0], *rows[0]["window_rows"][0]}
    assert not any(" " in name for name in names)
    assert rows[2]["window_rows"][0]["probability_of_good"] is None
    windows = [window for row in rows for window in row["window_rows"]]
    assert {window["alarm"] for window in windows} <= {True, False, None}


@pytest.mark.parametrize(
    "name", ["bearing.skops", "table.csv", "good.csv", "out.csv", "link.csv"]
)
def test_an_output_never_replaces_an_input(diagnose, run, plant, name):
    np.savetxt(plant / "good.csv", np.load(plant / "good.npy"))
    if name == "link.csv":
        if os.name == "nt":
            pytest.skip("Windows does not let everybody make a link")
        (plant / "link.csv").symlink_to(plant / "good.csv")
    (plant / "out_windows.csv").write_bytes((plant / "good.csv").read_bytes())
    before = {path: path.read_bytes() for path in plant.iterdir()}
    table = ("--table", plant / "table.csv")
    files = (plant / "good.csv", plant / "out_windows.csv")
    code, _, err = diagnose(*files, *table, "-o", plant / name)
    assert code == 2 and "argument -o/--output" in err
    code, _, err = run("fit", plant / "table.csv", "-o", plant / "good.npy")
    assert code == 2 and "is an input" in err
    assert {path: path.read_bytes() for path in plant.iterdir()} == before


def test_files_are_replaced_on_request_only(diagnose, run, plant):
    precious = plant / "notes.csv"
    precious.write_text("recording,what I saw\n")
    arguments = (plant / "good.npy", "-o", precious)
    code, _, err = diagnose(*arguments, force=False)
    assert code == 2
    assert "notes.csv exists; --force replaces it" in err
    assert precious.read_text() == "recording,what I saw\n"
    assert diagnose(*arguments)[0] == 0
    assert pd.read_csv(precious)["verdict"].tolist() == ["good"]
    model = plant / "notes.skops"
    model.write_text("no model")
    table = plant / "table.csv"
    table.write_text("path,condition,sampling_rate\ngood.npy,good,5\nworn.npy,worn,5\n")
    fit = ("fit", table, "-o", model, "--window-length", WINDOW)
    assert run(*fit, force=False)[0] == 2 and model.read_text() == "no model"
    assert run(*fit)[0] == 0


@pytest.mark.parametrize("name", ["out.txt", "out", "nowhere/out.csv", "."])
def test_outputs_that_cannot_be_are_refused_before_anything_is_read(
    diagnose, plant, name
):
    arguments = (plant / "good.npy", "-o", plant / name)
    code, out, err = diagnose(*arguments)
    assert code == 2 and not out
    assert "argument -o/--output" in err and "good.npy" not in err


def test_scripts_learn_of_an_alarm_by_the_exit_status(diagnose, plant):
    alarm = ("--fail-on", "alarm")
    files = {name: plant / f"{name}.npy" for name in ("good", "worn", "dead", "lost")}
    assert diagnose(files["good"], *alarm)[0] == 0
    assert diagnose(files["good"], files["worn"])[0] == 0
    # A fault, a dead sensor and a file that cannot be read are not healthy.
    for name in ("worn", "dead", "lost"):
        assert diagnose(files["good"], files[name], *alarm)[0] == 3
    assert diagnose(files["lost"], files["good"])[0] == 1


def test_progress_is_printed_and_can_be_silenced(diagnose, plant):
    arguments = (plant / "good.npy", plant / "worn.npy")
    err = diagnose(*arguments, "--n-jobs", "1")[2]
    assert [line[:5] for line in err.splitlines()] == ["[1/2]", "[2/2]"]
    assert err.splitlines()[0].endswith("good.npy: good")
    code, quiet_out, err = diagnose(*arguments, "-q")
    # The verdicts, and what they are worth.
    assert (code, err) == (0, "") and len(quiet_out.splitlines()) == 4
    assert "No alarm: the speed is not stated." in quiet_out
    assert all(name in quiet_out for name in ("good.npy", "worn.npy", "alarm"))


def test_results_may_lie_in_the_folder_of_the_recordings(diagnose, plant):
    folder = plant / "runs"
    folder.mkdir()
    for name in ("good", "worn"):
        (folder / f"{name}.npy").write_bytes((plant / f"{name}.npy").read_bytes())
    arguments = (folder, "-o", folder / "out.csv")
    for _ in range(2):
        code, _, err = diagnose(*arguments)
        assert code == 0 and "[2/2]" in err
    assert len(pd.read_csv(folder / "out.csv")) == 2


def test_a_file_that_changes_while_read_has_no_verdict(diagnose, plant, monkeypatch):
    path = plant / "good.npy"
    open_recording = SavedModel.open

    def replaced(model, recording, *arguments):
        opened = open_recording(model, recording, *arguments)
        if recording.path == path:
            os.utime(path, ns=(1, 1))
        if recording.path.name == "dead.npy":
            recording.path.unlink()
        return opened

    monkeypatch.setattr(SavedModel, "open", replaced)
    files = (path, plant / "dead.npy", plant / "worn.npy")
    code, _, err = diagnose(*files, "-o", plant / "out.csv")
    assert code == 1 and f"{path}: the file changed while it was read" in err
    assert "dead.npy" in err.partition("2 of 3 recordings failed")[2]
    rows = pd.read_csv(plant / "out.csv")
    assert rows["verdict"].str.startswith("no verdict").tolist() == [True, True, False]


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_link_that_is_made_after_the_check_is_not_followed(run, plant, monkeypatch):
    precious, model = plant / "notes.txt", plant / "new.skops"
    precious.write_text("what I saw")
    train = fit.training_rows

    def linked(*arguments, **options):
        model.symlink_to(precious)
        return train(*arguments, **options)

    monkeypatch.setattr(fit, "training_rows", linked)
    table = plant / "table.csv"
    table.write_text("path,condition,sampling_rate\ngood.npy,good,5\nworn.npy,worn,5\n")
    command = ("fit", table, "-o", model, "--window-length", WINDOW)
    assert run(*command)[0] == 0
    assert precious.read_text() == "what I saw" and not model.is_symlink()
