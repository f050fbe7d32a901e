import json

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio, make_detector, save_diagnoser

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


def test_what_fit_saved_is_told(run, tmp_path, windows):
    lines = ["path,condition,rpm,sampling_rate,channel"]
    for name in ("worn", "good"):
        X = windows[0][windows[1] == name].ravel()
        np.savez(tmp_path / f"{name}.npz", drive=X, load=np.arange(X.size))
        lines.append(f"{name}.npz,{name},300,5e3,drive;load")
    (tmp_path / "table.csv").write_text("\n".join(lines))
    model = tmp_path / "m.skops"
    fit = ("fit", tmp_path / "table.csv", "-o", model, "--window-length", WINDOW)
    assert run(*fit, "--diagnoser", "alpio", "--false-alarm-rate", "0.02")[0] == 0
    code, out, _ = run("info", model)
    rows, limits = card(out)
    assert code == 0 and rows["Model"] == str(model)
    assert rows["Diagnoser"].startswith("alpio: ARXLaguerre -> PIObserver -> ThresholdLadder")
    assert rows["Conditions"] == (
        "good (1 recordings, 20 windows), worn (1 recordings, 20 windows)"
    )
    assert rows["Healthy"] == "good" and rows["Speeds"] == "300 rpm"
    assert rows["Window"] == "200 samples, 0.04 s" and rows["Sampling rate"] == "5000 Hz"
    assert rows["Channels"] == "2, the output first (drive, load)"
    assert rows["False alarms"] == "a rate of 0.02 was asked for"
    assert rows["Saved by"].startswith("skarxlag ") and " on 20" in rows["Saved by"]
    assert "20 healthy windows cannot hold a false-alarm rate of 0.02" in limits
    assert "1/21 = 0.048. It takes 49 windows." in limits
    facts = json.loads(run("info", model, "--json")[1])
    assert facts["conditions"] == ["good", "worn"] and facts["n_windows"] == [20, 20]
    assert any("cannot hold" in sentence for sentence in facts["limits"])


def test_what_save_diagnoser_saved_is_told_as_far_as_it_is_known(run, tmp_path, windows):
    X, y = windows
    save_diagnoser(make_alpio(healthy="good").fit(X, y), tmp_path / "m.skops")
    rows, limits = card(run("info", tmp_path / "m.skops")[1])
    assert rows["Conditions"] == "good, worn" and rows["Sampling rate"] == "not stated"
    assert rows["Speeds"] == "not stated" and rows["Window"] == "200 samples"
    assert "Nobody can check the sampling rate" in limits
    save_diagnoser(make_detector(false_alarm_rate=0.1).fit(X[:20]), tmp_path / "d.skops")
    rows, limits = card(run("info", tmp_path / "d.skops")[1])
    assert rows["Healthy"] == "healthy" and "names no fault" in limits
