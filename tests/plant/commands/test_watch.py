import io
import os
import signal
import sys
import threading
import time

import numpy as np
import pytest
from scipy.io import wavfile

from skarxlag import load_monitor_state, make_detector, make_windows, save_diagnoser
from skarxlag.plant.commands import main
from skarxlag.plant.watch.live import from_growing_file
from skarxlag.plant.watch.live_samples import RawSamples
from tests.plant.commands.watching import (
    IDLE,
    RATE,
    WINDOW,
    blocks_of,
    drained,
    expected,
    lines_of,
    parsed,
    sound,
    text_samples,
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
    assert "lines that are no numbers: 2" in err and "1 not finite" in err


def test_a_growing_file_is_followed_and_a_restart_goes_on_where_it_was(
    run, models, fitted, tmp_path
):
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    signal = np.concatenate([sound("good", 1000, 3), sound("worn", 1000, 4)])
    content = lines_of(signal)
    options = (*IDLE, "--state", state, "--hop", 90)
    cut = len(content) // 3 + 1
    path.write_bytes(content[:cut])
    before = run("watch", models[0], path, *options)[1]
    path.write_bytes(content)
    after = run("watch", models[0], path, *options)[1]
    assert verdicts_of(before + after) == expected(fitted, signal, hop=90)
    assert before and after
    assert run("watch", models[0], path, *options)[1] == ""


def test_a_growing_file_that_is_started_afresh(tmp_path):
    path, messages = tmp_path / "log.bin", []
    path.write_bytes(np.arange(6, dtype="<i2").tobytes())
    blocks = from_growing_file(path, RawSamples("<i2", None), messages.append)
    assert next(blocks).samples.tolist() == [[0, 1, 2, 3, 4, 5]]
    path.write_bytes(np.array([7, 8], dtype="<i2").tobytes())
    assert next(blocks) is None
    assert next(blocks).samples.tolist() == [[7, 8]]
    assert messages == [f"{path} was started afresh"]
    with open(path, "ab") as file:
        file.write(b"\x09")
    assert [block.samples.size for block in drained(blocks)] == [0]


def test_files_of_a_folder_are_one_recording(run, models, fitted, tmp_path):
    signal = np.concatenate([sound("good", 1000, 3), sound("worn", 1000, 4)])
    for number, part in enumerate(np.split(signal, [330, 950, 1700])):
        path = tmp_path / f"{number}.npy"
        np.save(path, part)
        os.utime(path, (1000 + number, 1000 + number))
    (tmp_path / "3b.npy").write_bytes(b"no array")
    (tmp_path / ".hidden.npy").write_bytes(b"")
    code, out, err = run("watch", models[0], tmp_path, *IDLE)
    found = verdicts_of(out)
    assert code == 0
    assert [v.pop("source") for v in found] == ["0.npy"] + ["1.npy"] * 3 + [
        "2.npy"
    ] * 4 + ["3.npy"] * 2
    assert found == expected(fitted, signal)
    assert "skipped" in err and "3b.npy" in err


def test_times_of_files_show_gaps_and_the_state_which_files_were_read(
    run, models, tmp_path
):
    folder = tmp_path / "logger"
    folder.mkdir()
    state = tmp_path / "state.json"
    options = (*IDLE, "--timed-files", "--state", state)
    for number, end in enumerate([1000.0, 1001.0, 1030.0]):
        np.save(folder / f"{number}.npy", sound("good", 1000, number))
        os.utime(folder / f"{number}.npy", (end, end))
    code, out, err = run("watch", models[0], folder, *options)
    times = [v["time"] for v in verdicts_of(out)]
    assert code == 0
    assert times[0] == pytest.approx(999.2)
    assert times[-1] == pytest.approx(1030.0)
    assert "1 gap of 28.0 s" in err
    np.save(folder / "late.npy", sound("good", 1000, 9))
    os.utime(folder / "late.npy", (1031.0, 1031.0))
    found = verdicts_of(run("watch", models[0], folder, *options)[1])
    assert {v["source"] for v in found} == {"late.npy"} and len(found) == 5
    assert found[0]["start"] == 3000


def test_a_file_that_still_changes_is_left_for_later(tmp_path):
    path, sizes = tmp_path / "a.npy", []
    np.save(path, np.zeros(10))

    def write(look):
        """The logger writes once more while the folder is looked at for the second time."""
        sizes.append(path.stat().st_size)
        if look == 0:
            np.save(path, np.zeros(20))

    blocks = drained(blocks_of(tmp_path, None), write)
    assert [block.samples.shape for block in blocks] == [(1, 20)]
    assert sizes[0] < sizes[-1]


def test_a_file_that_was_written_some_time_ago_may_still_grow(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.zeros(20))
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    messages = []

    def write(look):
        """The logger writes the rest of its buffer long after the first part."""
        time.sleep(0.02)
        if look == 1:
            path.write_bytes(whole)

    source = blocks_of(tmp_path, messages.append, settle=0.08)
    blocks = drained(source, write, n_looks=9)
    assert [block.samples.shape for block in blocks] == [(1, 20)] and messages == []


def test_files_after_a_clock_was_set_back_are_read_with_a_warning(tmp_path):
    messages = []
    for name, moment in (("old", 900.0), ("a", 1000.0)):
        np.save(tmp_path / f"{name}.npy", np.zeros(10))
        os.utime(tmp_path / f"{name}.npy", (moment, moment))

    def write(look):
        if look == 2:
            np.save(tmp_path / "b.npy", np.ones(10))
            os.utime(tmp_path / "b.npy", (950.0, 950.0))

    # What lay there when an earlier run had read up to 900 s counts as read.
    source = blocks_of(tmp_path, messages.append, [900 * 10**9, "old.npy"])
    blocks = drained(source, write)
    assert [block.source for block in blocks] == ["a.npy", "b.npy"]
    assert messages == [
        f"{tmp_path / 'b.npy'}: older than the file before, read nevertheless"
    ]
    # The place is that of the latest file: a restart does not read a file twice.
    assert [block.position for block in blocks] == [[1000 * 10**9, "a.npy"]] * 2


def test_a_file_of_other_rate_or_channels_is_skipped_with_a_warning(
    run, models, tmp_path
):
    signal = sound("good", 450, 3)
    wavfile.write(tmp_path / "a.wav", 1001, signal.astype(np.float32))
    wavfile.write(tmp_path / "b.wav", 1100, signal.astype(np.float32))
    wavfile.write(
        tmp_path / "c.wav", 1000, np.stack([signal, signal], axis=1).astype(np.float32)
    )
    code, out, err = run("watch", models[0], tmp_path, *IDLE)
    assert code == 0 and {v["source"] for v in verdicts_of(out)} == {"a.wav"}
    assert "b.wav: sampling_rate is 1000 Hz but the file states 1100 Hz" in err
    assert "c.wav: several channels and none chosen" in err
    code, out, err = run("watch", models[0], tmp_path, *IDLE, "--channel", "0;1")
    assert out == "" and "c.wav: the number of channels is 2, expected 1" in err


def test_a_log_that_is_rotated_is_read_to_its_end_first(tmp_path):
    path, messages = tmp_path / "log.csv", []
    path.write_text("x\n1\n2\n3\n4")
    blocks = from_growing_file(path, text_samples(), messages.append)
    assert next(blocks).samples.tolist() == [[1, 2, 3]]
    with open(path, "a") as file:
        file.write("5\n6")
    path.rename(tmp_path / "log.1")
    path.write_text("time;x\ns;g\n0;7,5\n1;8,5\n")
    samples = [
        block.samples.tolist() for block in drained(blocks) if block.samples.size
    ]
    assert samples == [[[45]], [[7.5, 8.5]]]
    assert messages == [f"{path} was started afresh"]


def test_a_stream_of_another_number_of_channels_is_refused(run, models, piped):
    piped(b"1.0,2.0\n" * 300)
    code, out, err = run("watch", models[0], "-")
    assert code == 1 and out == ""
    assert "2 channels, expected 1; --channel chooses" in err


def test_european_lines_with_times_and_units(run, models, fitted, piped, tmp_path):
    signal = np.round(sound("worn", 650, 4), 4)
    lines = [f"{k / 1000:.3f};{value:.4f};7\r\n" for k, value in enumerate(signal)]
    text = "Zeit;Lager A;Drehzahl\r\ns;m/s2;1/min\r\n" + "".join(lines).replace(
        ".", ","
    )
    piped(text.encode())
    options = ("--channel", "Lager*")
    code, out, err = run("watch", models[0], "-", *options)
    assert code == 0 and verdicts_of(out) == expected(fitted, signal)
    assert "no numbers" not in err
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    found = []
    for end in (30, 9000, len(text)):
        path.write_bytes(text[:end].encode())
        out, err = run("watch", models[0], path, *options, *IDLE, "--state", state)[1:]
        found += verdicts_of(out)
        assert "no numbers" not in err
    wanted = expected(fitted, signal)
    # A later run takes the time anew from the lines, which are rounded.
    assert [v.pop("time") for v in found] == pytest.approx(
        [v.pop("time") for v in wanted]
    )
    assert found == wanted


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


def test_lines_come_in_any_pieces():
    signal = np.array([[1.5, 2.5, -3.0, 0.0, 7.0], [4.0, 5.0, 6.0, 1e-5, 8.0]])
    data = b"# from the logger\n" + lines_of(signal, "\t")
    whole = parsed(text_samples(), data)
    assert whole.tolist() == signal.tolist()
    pieces = text_samples()
    parts = [parsed(pieces, data[i : i + 1]) for i in range(len(data))]
    np.testing.assert_array_equal(
        np.concatenate([p for p in parts if p.size], axis=1), whole
    )
    unfinished = text_samples("1")
    assert parsed(unfinished, b"1 2\n3 4\n5 6\n7 8\n9 1").tolist() == [
        [2.0, 4.0, 6.0, 8.0]
    ]
    assert unfinished.n_pending == 3
    assert parsed(unfinished, b"", is_end=True).tolist() == [[1.0]]
    few = text_samples()
    assert parsed(few, b"1,2,\n3,4,\n").size == 0 and few.n_pending == 10
    assert parsed(few, b"", is_end=True).tolist() == [[1.0, 3.0], [2.0, 4.0]]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ("gone.csv", 1, "gone.csv: no such file or folder"),
        ("- --channel a", 1, "no channel 'a'; available: '0'"),
        ("- --channel 1 --dtype <i2", 1, "no channel '1'; available: '0'"),
        ("- --sampling-rate 999", 0, "2 samples"),
        ("- --sampling-rate 900", 2, "--sampling-rate: 900, but"),
        ("- --dtype text", 1, "dtype is 'text', expected real numbers such as"),
        ("- --hop 0", 1, "hop == 0, must be >= 1"),
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


def test_a_state_of_other_settings_gives_the_place_only(run, models, fitted, tmp_path):
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    samples = sound("good", 900, 3)
    path.write_bytes(lines_of(samples[:450]))
    assert run("watch", models[0], path, *IDLE, "--state", state)[0] == 0
    path.write_bytes(lines_of(samples))
    code, out, err = run("watch", models[0], path, *IDLE, "--state", state, "--hop", 50)
    assert code == 0
    assert "The state has hop 200, and now it is 50. Verdicts and the alarm" in err
    assert verdicts_of(out) == expected(fitted, samples[450:], hop=50)
