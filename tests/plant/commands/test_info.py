import json

import numpy as np
import pytest
from scipy.signal import lfilter
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skarxlag import ARXLaguerre, PIObserver, make_alpio, make_detector, save_diagnoser
from skarxlag.plant.commands.diagnose import diagnose
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.readers.listing import list_files

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

WINDOW = 200


@pytest.fixture(scope="module")
def windows():
    X = np.random.default_rng(0).normal(size=(40, WINDOW))
    X[20:] = lfilter([1.0], [1.0, -0.9], X[20:])
    return X, np.repeat(["worn", "good"], 20)


def card(out):
    """The lines above the limits by their names, and the limits as one line."""
    head, limits = out.split("Limits\n")
    rows = dict(line.split("  ", 1) for line in head.splitlines())
    return {name: text.strip() for name, text in rows.items()}, " ".join(limits.split())


def test_what_fit_saved_is_printed(run, tmp_path, windows):
    lines = ["path,condition,rpm,sampling_rate,channel"]
    for name in ("worn", "good"):
        X = windows[0][windows[1] == name].ravel()
        np.savez(tmp_path / f"{name}.npz", drive=X, load=np.arange(X.size))
        lines.append(f"{name}.npz,{name},300,5e3,drive;load")
    (tmp_path / "table.csv").write_text("\n".join(lines))
    model = tmp_path / "m.skops"
    fit = ("fit", tmp_path / "table.csv", "-o", model, "--window-length", WINDOW)
    assert run(*fit, "--diagnoser", "diagnoser", "--false-alarm-rate", "0.02")[0] == 0
    code, out, _ = run("info", model)
    rows, limits = card(out)
    assert code == 0 and rows["file"] == str(model)
    assert rows["diagnoser"] == "diagnoser"
    assert rows["steps"].startswith("ARXLaguerre -> ConditionClassifier")
    expected = {
        "conditions": "good, worn",
        "n windows": "20, 20",
        "healthy": "good",
        "train rpm": "300 rpm",
        "window length": "200 samples",
        "sampling rate": "5000 Hz",
        "channels": "drive, load",
        "false alarm rate": "0.02",
    }
    assert expected.items() <= rows.items()
    assert "20 healthy windows are too few to hold the rate 0.02" in limits
    assert "1/21 = 0.048. Use at least 49 rows." in limits
    facts = json.loads(run("info", model, "--json")[1])
    assert facts["conditions"] == ["good", "worn"] and facts["n_windows"] == [20, 20]
    assert any("too few" in sentence for sentence in facts["limits"])


def test_what_save_diagnoser_saved_is_printed_as_far_as_it_is_known(
    run, tmp_path, windows
):
    X, y = windows
    save_diagnoser(make_alpio(healthy="good").fit(X, y), tmp_path / "m.skops")
    rows, limits = card(run("info", tmp_path / "m.skops")[1])
    assert rows["conditions"] == "good, worn" and rows["sampling rate"] == "not stated"
    assert rows["train rpm"] == "not stated" and rows["window length"] == "200 samples"
    assert "The sampling rate of recordings cannot be checked" in limits
    detector = make_detector(false_alarm_rate=0.1)
    detector.fit(X[:20], rpm=np.repeat([300.0, 600.0], 10))
    save_diagnoser(detector, tmp_path / "d.skops")
    rows, limits = card(run("info", tmp_path / "d.skops")[1])
    assert rows["healthy limits"].startswith(
        "20 healthy rows; false alarms at speeds that were"
    )
    assert rows["healthy"] == "healthy" and "names no fault" in limits


@pytest.mark.slow
def test_a_classifier_of_scikit_learn_in_all_commands(run, windows, piped, tmp_path):
    X, y = windows
    for name in ("good", "worn"):
        np.save(tmp_path / f"{name}.npy", X[y == name].ravel())
    path = tmp_path / "m.skops"
    steps = ARXLaguerre(order=4), PIObserver(), StandardScaler(), LogisticRegression()
    facts = {"conditions": ["good", "worn"], "sampling_rate": 1e3}
    save_diagnoser(make_pipeline(*steps).fit(X, y), path, **facts)
    rows, limits = card(run("info", path)[1])
    assert rows["steps"].startswith("ARXLaguerre -> PIO") and "no alarm" in limits
    found, diagnoses = diagnose(list_files(tmp_path / "*.npy"), SavedModel(path))
    assert found["verdict"].tolist() == ["good", "worn"] and set(found["alarm"]) == {
        "-"
    }
    reason = "No alarm: no healthy limits were learned"
    assert all(reason in " ".join(each.remarks) for each in diagnoses)
    piped(X[0].tobytes())
    line = json.loads(run("watch", path, "-", "--dtype", "<f8")[1])
    assert line["verdict"] == "worn" and line["alarm"] is None


def test_channels_of_a_recording(run, tmp_path):
    lines = [f"{k / 1000},{k % 7},{900 + k % 2}" for k in range(1000)]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["time (s),acc (g),rpm", *lines]))
    code, out, _ = run("info", path)
    head, *rows, speed = out.splitlines()
    assert code == 0 and head.split() == ["channel", "sampling_rate", "unit", "rpm"]
    assert rows[1].split() == ["1", "acc", "(g)", "1000.0", "g", "-"]
    assert speed == "Shaft speed: 900.5 rpm"
    found = json.loads(run("info", path, "--json")[1])
    assert found["rpm"] == 900.5 and found["channels"][0]["sampling_rate"] is None
    expected = ["time (s)", "acc (g)", "rpm"]
    assert [row["channel"] for row in found["channels"]] == expected
    np.savez(tmp_path / "none.npz", y=np.arange(5.0))
    assert "Shaft speed: not stated" in run("info", tmp_path / "none.npz")[1]
