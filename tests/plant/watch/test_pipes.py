import io
import os
import signal
import sys
import threading

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
    assert alarm.startswith("Alarm: after ") and alarm.endswith(" a year of signal.")
    last = verdicts_of(out)[-1]
    assert summary.startswith(
        "2050 samples; windows: 10 good; no gaps; 0 alarms; last: 2.0 s, worn, probability "
    )
    assert ", alarm off at 0%, " in summary
    assert summary.endswith(f"p-value {last['p_value']:.2g}")


@pytest.mark.parametrize(
    ("dtype", "scale"), [("<i2", 1000), ("<f4", 1.0), (">f8", 1.0)]
)
def test_raw_samples_on_standard_input(run, models, fitted, piped, dtype, scale):
    samples = (scale * sound("worn", 700, 4)).astype(dtype)
    piped(samples.tobytes() + b"\0")
    code, out, _ = run("watch", models[0], "-", "--dtype", dtype)
    assert code == 0
    assert verdicts_of(out) == expected(fitted, samples)


def test_columns_are_chosen_and_bad_lines_are_missing_samples(
    run, models, fitted, piped
):
    signal = sound("good", 600, 3)
    lines = lines_of(np.stack([np.zeros(600), signal]), ";").splitlines()
    lines[250] = b"sensor lost"
    lines[251] = b"1.0"
    piped(b"a;b\n" + b"\n".join(lines))
    code, out, err = run("watch", models[0], "-", "--channel", 1)
    signal[250:252] = np.nan
    assert code == 0 and verdicts_of(out) == expected(fitted, signal)
    assert "1 not finite" in err


def test_a_stream_of_another_number_of_channels_is_refused(run, models, piped):
    piped(b"1.0,2.0\n" * 300)
    code, out, err = run("watch", models[0], "-")
    assert code == 1 and out == ""
    assert "2 channels, expected 1; --channel chooses" in err


def test_european_lines_with_times_and_units(run, models, fitted, piped):
    signal = np.round(sound("worn", 650, 4), 4)
    lines = [f"{k / 1000:.3f};{value:.4f};7\r\n" for k, value in enumerate(signal)]
    text = "Zeit;Lager A;Drehzahl\r\ns;m/s2;1/min\r\n" + "".join(lines).replace(
        ".", ","
    )
    piped(text.encode())
    options = ("--channel", "Lager*")
    code, out, _ = run("watch", models[0], "-", *options)
    assert code == 0 and verdicts_of(out) == expected(fitted, signal)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_a_named_pipe(run, models, fitted, tmp_path):
    signal, path = sound("worn", 450, 4), tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(lines_of(signal),))
    writer.start()
    out = run("watch", models[0], path)[1]
    writer.join()
    assert verdicts_of(out) == expected(fitted, signal)


def test_fewer_lines(run, models, fitted, piped):
    signal = np.concatenate([sound("good", 3000, 3), sound("worn", 3000, 4)])
    signal[1500] = np.nan
    piped(lines_of(signal))
    options = ("--half-life", 0.5, "--every", 1)
    found = verdicts_of(run("watch", models[0], "-", *options)[1])
    every = expected(fitted, signal, half_life=0.5)
    news = [(v["verdict"], v["alarm"], v["quality"]) for v in every]
    kept = [0]
    for i in range(1, len(every)):
        if (
            news[i] != news[kept[-1]]
            or every[i]["time"] - every[kept[-1]]["time"] > 0.999
        ):
            kept.append(i)
    assert found == [every[i] for i in kept]
    assert {v["quality"] for v in found} == {"good", "not finite"} and len(found) < 13


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
    assert err.splitlines()[-1].startswith("450 samples; windows: 2 good; no gaps;")
    assert load_monitor_state(state)[0]["stream"]["n_samples"] == 450


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ("gone.csv", 1, "gone.csv: no such file or folder"),
        ("- --channel a", 1, "no channel 'a'; available: '0'"),
        ("- --channel 1 --dtype <i2", 1, "no channel '1'; available: '0'"),
        ("- --sampling-rate 999", 0, "2 samples"),
        ("- --sampling-rate 900", 2, "--sampling-rate: 900, but"),
        ("- --dtype text", 1, "dtype is 'text', expected real numbers such as"),
        ("- --alarm-delay 1001", 1, "alarm_delay == 1001, expected at most 1000"),
        ("- --latch", 2, "argument --latch: needs --state"),
        ("- --half-life 0", 2, "argument --half-life: '0', expected a number above 0"),
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


def test_p_values_come_from_the_healthy_limits_of_the_model(
    run, fitted, piped, tmp_path
):
    path, loud = tmp_path / "model.skops", 99 * sound("good", 2000, 3)
    detector = make_detector(fixed_gain=True).fit(
        make_windows(sound("good", 20_000, 2), WINDOW)
    )
    facts = {
        "conditions": ["good", "worn"],
        "sampling_rate": RATE,
        "window_length": WINDOW,
    }
    last = {}
    for name, limits in (("limits", detector), ("none", None)):
        save_diagnoser(fitted[0], path, detector=limits, **facts)
        piped(lines_of(loud))
        last[name] = verdicts_of(run("watch", path, "-")[1])[-1]
    assert last["limits"]["p_value"] < 0.01 and last["limits"]["alarm_level"] > 0
    assert last["none"]["p_value"] is None


def test_limits_that_do_not_hold_are_reported_once(run, fitted, piped, tmp_path):
    path = tmp_path / "alone.skops"
    facts = {
        "conditions": ["worn", "good"],
        "sampling_rate": RATE,
        "train_rpm": [900.0],
    }
    save_diagnoser(fitted[0], path, window_length=WINDOW, **facts)
    piped(lines_of(sound("good", 1000, 3)))
    code, out, err = run("watch", path, "-", "--rpm", 1800)
    found = verdicts_of(out)
    assert code == 0
    assert err.count("No alarm: healthy limits hold at 900 rpm only.") == 1
    assert {(v["limits"], v["exceeds"], v["rpm"], v["healthy"]) for v in found} == {
        ("healthy limits hold at 900 rpm only", None, 1800.0, "worn")
    }


def test_a_detector_of_several_speeds_asks_for_the_speed(run, fitted, piped, tmp_path):
    signal, path = sound("good", 450, 3), tmp_path / "detector.skops"
    healthy = make_windows(sound("good", 100 * WINDOW, 2), WINDOW)
    save_diagnoser(
        make_detector().fit(healthy, rpm=np.repeat([300.0, 500.0], 50)),
        path,
        sampling_rate=RATE,
    )
    piped(lines_of(signal))
    code, _, err = run("watch", path, "-")
    assert code == 2
    assert "argument --rpm: needed, " in err
    assert "fitted at 300, 500 rpm" in err
    code, out, _ = run("watch", path, "-", "--rpm", "400")
    assert code == 0 and [v["alarm"] for v in verdicts_of(out)] == [False, False]
