"""Verdicts on a pipe or standard input, in ``watch``."""

import io
import json
import os
import signal
import sys
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from skarxlag import load_monitor_state, make_detector, make_windows, save_diagnoser
from skarxlag.plant.commands import main
from tests.plant.watch.watching import (
    RATE,
    WINDOW,
    expected,
    lines_of,
    sound,
    verdicts_of,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


def test_csv_lines_on_standard_input(run, models, fitted, piped):
    signal = np.concatenate([sound("good", 1000, 3), sound("worn", 1050, 4)])
    piped(b"acceleration\n" + lines_of(signal))
    code, out, err = run("watch", models[0], "-", "--half-life", 0.5)
    assert code == 0
    assert verdicts_of(out) == expected(fitted, signal, half_life=0.5)
    heading, alarm, summary = err.splitlines()
    assert heading.endswith("Healthy: good")
    assert alarm.startswith("Alarm: after ") and alarm.endswith(" h of signal.")
    assert summary == "last: worn; alarm: off"


@pytest.mark.parametrize(
    ("dtype", "scale"), [("<i2", 1000), ("<f4", 1.0), (">f8", 1.0)]
)
def test_raw_samples_on_standard_input(watch, fitted, dtype, scale):
    samples = (scale * sound("worn", 700, 4)).astype(dtype)
    code, verdicts, _ = watch(samples.tobytes() + b"\0", "--dtype", dtype)
    assert code == 0 and verdicts == expected(fitted, samples)


def test_columns_are_chosen_and_bad_lines_are_missing_samples(watch, fitted):
    signal = sound("good", 600, 3)
    lines = lines_of(np.stack([np.zeros(600), signal]), ";").splitlines()
    lines[250] = b"sensor lost"
    lines[251] = b"1.0"
    code, verdicts, _ = watch(b"a;b\n" + b"\n".join(lines), "--channel", 1)
    signal[250:252] = np.nan
    assert code == 0 and verdicts == expected(fitted, signal)
    assert "not finite" in {v["quality"] for v in verdicts}


def test_each_line_states_sensor_date_and_speed(run, models, piped):
    before = datetime.now(UTC) - timedelta(seconds=1)
    piped(lines_of(sound("good", 450, 3)))
    code, out, _ = run("watch", models[0], "-", "--rpm", 900)
    lines = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    assert {(line["sensor"], line["rpm"]) for line in lines} == {("diagnoser", 900.0)}
    assert [line["seconds"] for line in lines] == [0.2, 0.4]
    assert not any(" " in name for line in lines for name in line)
    for line in lines:
        assert before < datetime.fromisoformat(line["time"]) <= datetime.now(UTC)


def test_nobody_reads_the_output(models, piped, monkeypatch, capsys):
    piped(lines_of(sound("good", 450, 3)))
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w") as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        assert main(["watch", str(models[0]), "-"]) == 141
    assert "Broken" not in capsys.readouterr().err


class Output(io.StringIO):
    """Standard output whose second line comes with a signal."""

    def __init__(self, number):
        super().__init__()
        self._number = number

    def write(self, text):
        super().write(text)
        if self.getvalue().count("\n") == 2:
            signal.raise_signal(self._number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_termination_end_cleanly(run, models, monkeypatch, number, tmp_path):
    reading, writing = os.pipe()
    os.write(writing, lines_of(sound("good", 450, 3)))
    with open(reading, "rb") as pipe, open(writing, "wb"):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(pipe))
        # Nobody writes any more, and nobody closes the pipe: only the signal can end
        # it.
        monkeypatch.setattr(sys, "stdout", Output(number))
        state = tmp_path / "state.json"
        code, _, err = run("watch", models[0], "-", "--state", state)
    assert code == 0
    assert err.splitlines()[-1] == "last: good; alarm: off"
    assert load_monitor_state(state)[0]["stream"]["n_samples"] == 450


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ("gone.csv", 1, "gone.csv: no such file or folder"),
        ("- --sampling-rate 999", 0, "last: None"),
        ("- --sampling-rate 900", 2, "--sampling-rate: 900.0 Hz, but"),
        ("- --alarm-delay 1001", 1, "alarm_delay == 1001, expected at most 1000"),
        ("- --latch", 2, "argument --latch: needs --state"),
        ("- --rpm-column n --dtype <f4", 2, "belongs to csv lines"),
        ("- --rpm log.csv", 2, "log.csv is for a folder; use --rpm-column"),
    ],
)
def test_mistakes_are_reported_in_one_line(
    run, models, piped, arguments, code, message
):
    piped(b"1.0\n2.0\n")
    status, out, err = run("watch", models[0], *arguments.split())
    assert status == code and message in err and out == "" and "Traceback" not in err


def test_a_detector_alone_names_the_healthy_condition(run, models, piped):
    piped(lines_of(sound("good", 450, 3)))
    found = verdicts_of(run("watch", models[1], "-")[1])
    assert [(v["verdict"], v["healthy"]) for v in found] == [("good", "good")] * 2
    assert found[0]["alarm"] is False and found[0]["probability"] is None


def test_limits_that_do_not_hold_are_reported_once(run, fitted, piped, tmp_path):
    path = tmp_path / "alone.skops"
    facts = {"conditions": ["worn", "good"], "train_rpm": [900.0]}
    save_diagnoser(fitted[0], path, window_length=WINDOW, sampling_rate=RATE, **facts)
    piped(lines_of(sound("good", 1000, 3)))
    code, out, err = run("watch", path, "-", "--rpm", 1800)
    reason = "healthy limits hold at 900 rpm only"
    assert code == 0 and err.count(f"No alarm: {reason}.") == 1
    assert {
        (v["limits"], v["exceeds"], v["rpm"], v["healthy"]) for v in verdicts_of(out)
    } == {(reason, None, 1800.0, "worn")}


def test_a_detector_of_several_speeds_asks_for_the_speed(run, piped, tmp_path):
    path = tmp_path / "detector.skops"
    healthy = make_windows(sound("good", 100 * WINDOW, 2), WINDOW)
    detector = make_detector().fit(healthy, rpm=np.repeat([300.0, 500.0], 50))
    save_diagnoser(detector, path, sampling_rate=RATE)
    piped(lines_of(sound("good", 450, 3)))
    code, _, err = run("watch", path, "-")
    assert code == 2 and "argument --rpm: needed, " in err
    assert "fitted at 300, 500 rpm" in err
    code, out, _ = run("watch", path, "-", "--rpm", "400")
    assert code == 0 and [v["alarm"] for v in verdicts_of(out)] == [False, False]
