"""Inputs of ``watch`` that are not as they should be."""

import os
import signal
import sys
import threading

import numpy as np
import pandas as pd
import pytest

from skarxlag import ConditionMonitor, save_monitor_state
from skarxlag.plant.watch.live import from_growing_file
from skarxlag.plant.watch.live_text import TextSamples
from skarxlag.plant.watch.live_times import StreamTimes
from tests.plant.commands.watching import (
    IDLE,
    RATE,
    WINDOW,
    drained,
    expected,
    lines_of,
    parsed,
    sound,
    text_samples,
    verdicts_of,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


SIGNAL = sound("good", 600, 3)


@pytest.mark.parametrize(
    ("text", "quality", "is_number"),
    [
        (b"NaN", "not finite", True),
        (b"-inf", "not finite", True),
        (b"1e999", "not finite", True),
        (b"1e308", "held", True),
        (b"1_000", "not finite", False),
        (b"\0\0", "not finite", False),
    ],
)
def test_a_value_that_is_no_sample(watch, text, quality, is_number):
    lines = lines_of(SIGNAL).splitlines()
    lines[300] = text
    code, verdicts, err = watch(b"\n".join(lines))
    assert code == 0
    assert [v["quality"] for v in verdicts] == ["good", quality, "good"]
    assert verdicts[1]["window_verdict"] is None
    assert ("lines that are no numbers: 1" not in err) == is_number


def test_decimal_commas_of_one_column(watch, fitted):
    signal = np.round(SIGNAL, 4)
    lines = [f"{value:+.4f}".replace(".", ",") for value in signal.tolist()]
    code, verdicts, _ = watch("\n".join(lines).encode())
    assert code == 0
    assert verdicts == expected(fitted, signal)


def test_names_that_come_again(watch, fitted):
    lines = lines_of([SIGNAL, SIGNAL]).splitlines()
    data = b"\n".join([b"a,b", *lines[:300], b"a,b", *lines[300:]])
    code, verdicts, err = watch(data, "--channel", "0")
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)
    assert "no numbers" not in err


@pytest.mark.parametrize("cut", [b".25", b"e-05", b"\xef\xbb\xbf17"])
def test_a_first_line_that_was_cut(watch, fitted, cut):
    data = b"\r\n".join([cut, *lines_of([SIGNAL, SIGNAL]).splitlines()])
    code, verdicts, err = watch(data, "--channel", "0")
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)
    assert "lines that are no numbers: 1" in err


@pytest.mark.parametrize("quote", ["", '"'])
def test_names_that_come_again_in_another_order(quote):
    lines = [
        *("time;y;u", "s;g;Nm", "0.1;1;-1", "0.2;2;-2", "0.3;x;-3"),
        *("u;time;y", "Nm;s;g", "-4;0.4;4"),
        *("y;time;temperature", "5;0.5;20", "y;u;time", "6;-6;.6"),
    ]
    for i in (0, 5, 8, 10):
        lines[i] = ";".join(f"{quote}{name}{quote}" for name in lines[i].split(";"))
    parser = TextSamples("y", StreamTimes("time", 10.0, 0.05, 10))
    ((samples, time),) = parser.parts("\n".join(lines).encode(), is_end=True)
    np.testing.assert_array_equal(samples, [[1, 2, np.nan, 4, 5, 6]])
    assert time == pytest.approx(0.1)
    assert +parser.unread == {"lines that are no numbers": 1}


@pytest.mark.parametrize("first", [b"", b"\xef\xbb\xbf", b"\xef\xbb\xbfacc\r\n"])
def test_a_byte_order_mark_and_two_signs_at_the_end_of_a_line(watch, fitted, first):
    code, verdicts, err = watch(first + lines_of(SIGNAL).replace(b"\n", b"\r\n"))
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)
    assert "no numbers" not in err


RAW = "expected csv lines in UTF-8; raw samples need --dtype"
LONG = "bytes without a line of numbers, expected csv lines"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (np.random.default_rng(0).bytes(100_000), RAW),
        (bytes(1_400_000), LONG),
        (b"1" * 1_400_000, LONG),
        (b"<html>\n<p>No\n</p>\n</html>\n", "'<p>No' is no line of 1 numbers"),
        ("1.5\n2.5\n".encode("utf-16"), "expected csv lines in UTF-8"),
        (b"1.5,5\n" * 300, "2 channels, expected 1; --channel chooses"),
        (b"512,498\n" * 300, "2 channels, expected 1; the comma may separate two col"),
    ],
)
def test_what_is_no_text_with_numbers(watch, data, message):
    code, verdicts, err = watch(data)
    assert code == 1
    assert verdicts == []
    assert "error: -: " in err
    assert message in err


def test_the_layout_does_not_depend_on_how_the_lines_come():
    data = b"1 2\n" * 6 + b"3,4\n" * 70
    whole = parsed(text_samples(), data)
    pieces = text_samples()
    parts = [parsed(pieces, data[i : i + 5]) for i in range(0, len(data), 5)]
    parts = [samples for samples in parts if samples.size]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)
    assert whole[:, 0].tolist() == [1.0, 2.0]
    assert pieces.unread["lines that are no numbers"] == 70


def test_a_line_without_an_end_takes_no_memory():
    parser = text_samples()
    noise = b"7" * 2**18
    assert parsed(parser, b"1\n2\n3\n4\n").shape == (1, 4)
    with pytest.raises(ValueError, match="1310720 bytes without a line of numbers"):
        for _ in range(40):
            assert parsed(parser, noise).size == 0


def test_raw_samples_that_are_none(run, models, piped):
    piped(np.ones(50, "<f4").tobytes() + b"abc")
    *_, err = run("watch", models[0], "-", "--dtype", "<f4")
    assert "bytes of a sample that is not whole: 3" in err
    code, _, err = run("watch", models[0], "-", "--dtype", "<c8")
    assert code == 1 and "dtype is '<c8', expected real numbers" in err


def test_no_standard_input(run, models, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    code, _, err = run("watch", models[0], "-")
    assert code == 1 and "-: there is no standard input" in err


@pytest.mark.skipif(
    sys.platform == "win32", reason="names and links that the system lacks"
)
def test_odd_entries_of_a_folder(run, models, tmp_path):
    folder = tmp_path / "logger"
    folder.mkdir()
    np.save(folder / "a:b\n.npy", sound("good", 450, 3))
    (folder / "c\n.npy").write_bytes(b"junk")
    (folder / "loop.npy").symlink_to("loop.npy")
    (folder / "gone.npy").symlink_to("nowhere")
    (folder / "folder.npy").mkdir()
    os.mkfifo(folder / "pipe.npy")
    code, out, err = run("watch", models[0], folder, *IDLE)
    assert code == 0 and [v["source"] for v in verdicts_of(out)] == ["a:b\\n.npy"] * 2
    _, _, skipped, summary = err.splitlines()
    assert "c\\n.npy: holds pickled objects" in skipped and "2 good" in summary


def test_a_folder_that_vanishes_ends_the_command(run, models, tmp_path):
    folder = tmp_path / "logger"
    folder.mkdir()
    threading.Timer(0.05, folder.rmdir).start()
    code, _, err = run("watch", models[0], folder, "--poll", 0.01)
    assert code == 1 and str(folder) in err and "Traceback" not in err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_a_file_that_is_removed_is_waited_for(tmp_path):
    path = tmp_path / "log.csv"
    steps = ["remove", "pipe", "folder", "file", "", ""]
    path.write_text("1\n2\n3\n4\n")

    def act(look):
        if path.is_dir():
            path.rmdir()
        elif steps[look]:
            path.unlink(missing_ok=True)
        if steps[look] == "pipe":
            os.mkfifo(path)
        elif steps[look] == "folder":
            path.mkdir()
        elif steps[look] == "file":
            path.write_text("5\n6\n7\n8\n")

    messages = []
    source = from_growing_file(path, text_samples(), messages.append)
    samples = [block.samples.tolist() for block in drained(source, act, len(steps))]
    assert samples == [[[1, 2, 3, 4]], [[5, 6, 7, 8]]]
    assert messages == [f"{path} was started afresh"]


@pytest.fixture
def log(run, models, tmp_path):
    """File that is watched with a state: its path, and the function that watches it."""
    path = tmp_path / "log.csv"
    path.write_bytes(lines_of(SIGNAL[:500]))
    options = (*IDLE, "--state", tmp_path / "state.json")

    def watch_on(*further, source=path):
        code, out, err = run("watch", models[0], source, *options, *further)
        return code, verdicts_of(out), err

    assert len(watch_on()[1]) == 2
    return path, watch_on


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--channel", "0", "of channel None, expected '0'"),
        ("--time-column", "none", "of time column None, expected 'none'"),
        ("--dtype", "<f4", "of dtype None, expected '<f4'"),
    ],
)
def test_a_state_belongs_to_its_arguments(log, tmp_path, option, value, message):
    saved = (tmp_path / "state.json").read_bytes()
    code, verdicts, err = log[1](option, value)
    assert (code, verdicts) == (1, [])
    assert message in err
    assert (tmp_path / "state.json").read_bytes() == saved


def test_a_state_belongs_to_its_source(log, tmp_path):
    path, watch_on = log
    other = tmp_path / "other.csv"
    other.write_bytes(lines_of(SIGNAL))
    code, verdicts, err = watch_on(source=other)
    assert (code, verdicts) == (1, [])
    assert f"state of source '{path.resolve()}', expected" in err


@pytest.mark.parametrize("is_rotated", [True, False])
def test_a_log_that_was_rotated_or_rewritten_is_read_from_its_beginning(
    log, is_rotated
):
    """Nobody watched meanwhile. The file of the old name is longer than before."""
    path, watch_on = log
    if is_rotated:
        path.rename(path.with_suffix(".1"))
    with path.open("wb") as file:
        file.write(lines_of(sound("worn", 1000, 4)))
    code, verdicts, err = watch_on()
    assert code == 0
    assert "was started afresh since the state was saved" in err
    # 100 samples waited, and all 1000 of the new file were read.
    assert [v["start"] for v in verdicts] == list(range(400, 1400, 200))
    # A file that only grew is continued.
    with path.open("ab") as file:
        file.write(lines_of(sound("worn", 200, 5)))
    code, verdicts, err = watch_on()
    assert code == 0
    assert "afresh" not in err
    assert len(verdicts) == 1


@pytest.mark.parametrize("position", [7, "here", [1], ["a", 1]])
def test_a_position_that_is_none(log, fitted, tmp_path, position):
    monitor = ConditionMonitor(fitted[0], RATE, window_length=WINDOW)
    save_monitor_state(monitor, tmp_path / "state.json", position=position)
    code, verdicts, err = log[1]()
    assert (code, verdicts) == (1, [])
    message = f"the position in the source is {position!r}, expected two values"
    assert f"state.json: {message}" in err


def test_a_state_that_cannot_be_written_is_reported_at_once(watch, tmp_path):
    state = tmp_path / "nowhere" / "state.json"
    code, verdicts, err = watch(lines_of(SIGNAL), "--state", state)
    assert (code, verdicts) == (1, [])
    assert "nowhere" in err


def test_a_request_to_end_waits_for_the_end_of_a_file(
    run, models, tmp_path, monkeypatch
):
    """The state holds whole files: a later run reads none twice, and none in part."""
    folder, state = tmp_path / "logger", tmp_path / "state.json"
    folder.mkdir()
    # Each group of rows is a block.
    table = pd.DataFrame({"acc": sound("good", 1000, 3)})
    table.to_parquet(folder / "a.parquet", row_group_size=200)
    written = []

    def write(self, verdicts, source):
        written.extend(verdicts)
        if len(written) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("skarxlag.plant.watch.stream.SensorStream._report", write)
    run("watch", models[0], folder, *IDLE, "--state", state)
    assert len(written) == 5
    run("watch", models[0], folder, *IDLE, "--state", state)
    assert len(written) == 5


RPM = np.repeat([900.0, 905.5], [400, 200])


@pytest.mark.parametrize(
    ("header", "columns", "options"),
    [
        (b"acc,n\n", [SIGNAL, RPM], ("n",)),
        (b"acc,speed of shaft\n", [SIGNAL, RPM], ("speed*",)),
        (b"", [SIGNAL, RPM], ("1",)),
        (b"n,acc\n", [RPM, SIGNAL], ("n", "--channel", "acc")),
    ],
)
def test_a_column_of_shaft_speeds(watch, header, columns, options):
    code, verdicts, err = watch(header + lines_of(columns), "--rpm-column", *options)
    assert code == 0, err
    assert [v["rpm"] for v in verdicts] == [900.0, 900.0, 905.5]


@pytest.mark.parametrize(
    ("code", "options", "message"),
    [
        (1, ("--rpm-column", "n"), "-: no channel 'n'"),
        (2, ("--rpm-column", "n", "--dtype", "<f4"), "belongs to csv lines"),
        (2, ("--rpm-column", "n", "--rpm", 900), "not allowed with argument"),
        (2, ("--rpm", "log.csv"), "log.csv is for a folder; use tacho:CHANNEL, --rpm-"),
    ],
)
def test_speeds_that_cannot_be_read(watch, code, options, message):
    result = watch(lines_of(SIGNAL), *options)
    assert result[0] == code
    assert message in result[2]


def test_a_folder_has_no_column_of_shaft_speeds(run, models, tmp_path):
    code, _, err = run("watch", models[0], tmp_path, "--rpm-column", "n")
    assert code == 2
    assert "--rpm-column: belongs to csv lines" in err
