"""What ``watch`` makes of inputs that are not as they should be."""

import os
import signal
import sys
import threading

import numpy as np
import pytest

from skarxlag import ConditionMonitor, save_monitor_state
from skarxlag.recordings.formats._contents import ContentError
from skarxlag.recordings.live import from_growing_file
from skarxlag.recordings.live_text import TextSamples
from skarxlag.recordings.live_times import StreamTimes
from tests.commands.watching import (
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


@pytest.mark.parametrize(
    ("text", "quality", "n_bad"),
    [
        (b"NaN", "not finite", 0),
        (b"-inf", "not finite", 0),
        (b"1e999", "not finite", 0),
        (b"1e308", "held", 0),
        (b"1_000", "not finite", 1),
        (b"\0\0", "not finite", 1),
    ],
)
def test_a_value_that_is_no_sample(run, models, piped, text, quality, n_bad):
    lines = lines_of(sound("good", 600, 3)).splitlines()
    lines[300] = text
    piped(b"\n".join(lines))
    code, out, err = run("watch", models[0], "-")
    found = verdicts_of(out)
    assert code == 0 and [v["quality"] for v in found] == ["good", quality, "good"]
    assert found[1]["window_verdict"] is None
    assert ("lines that are no numbers: 1" in err) == bool(n_bad)


def test_decimal_commas_of_one_column(run, models, fitted, piped):
    signal = np.round(sound("good", 600, 3), 4)
    piped(
        "\n".join(
            f"{value:+.4f}".replace(".", ",") for value in signal.tolist()
        ).encode()
    )
    code, out, _ = run("watch", models[0], "-")
    assert code == 0 and verdicts_of(out) == expected(fitted, signal)
    piped(b"512,498\n" * 600)
    code, _, err = run("watch", models[0], "-")
    assert code == 1
    assert "2 channels, expected 1; the comma may separate two columns" in err


def test_names_that_come_again_and_a_first_line_that_was_cut(
    run, models, fitted, piped
):
    samples = sound("good", 600, 3)
    lines = lines_of(np.stack([samples, samples])).splitlines()
    options = ("--channel", "0")
    piped(b"\n".join([b"a,b", *lines[:300], b"a,b", *lines[300:]]))
    code, out, err = run("watch", models[0], "-", *options)
    assert code == 0
    assert verdicts_of(out) == expected(fitted, samples)
    assert "no numbers" not in err
    for cut in (b".25", b"e-05", b"\xef\xbb\xbf17"):
        piped(b"\r\n".join([cut, *lines]))
        code, out, err = run("watch", models[0], "-", *options)
        assert code == 0 and verdicts_of(out) == expected(fitted, samples)
        assert "lines that are no numbers: 1" in err


@pytest.mark.parametrize("quote", ["", '"'])
def test_names_that_come_again_in_another_order(quote):
    def header(*names):
        return ";".join(f"{quote}{name}{quote}" for name in names) + "\n"

    text = header("time", "y", "u") + "s;g;Nm\n0.1;1;-1\n0.2;2;-2\n0.3;x;-3\n"
    text += header("u", "time", "y") + "Nm;s;g\n-4;0.4;4\n"
    text += (
        header("y", "time", "temperature")
        + "5;0.5;20\n"
        + header("y", "u", "time")
        + "6;-6;.6"
    )
    parser = TextSamples("y", StreamTimes("time", 10.0, 0.05, 10))
    parts = list(parser.parts(text.encode(), is_end=True))
    samples = np.concatenate([samples for samples, _ in parts], axis=1)
    np.testing.assert_array_equal(samples, [[1, 2, np.nan, 4, 5, 6]])
    assert parts[0][1] == pytest.approx(0.1) and len(parts) == 1
    assert +parser.unread == {"lines that are no numbers": 1}


@pytest.mark.parametrize("first", [b"", b"\xef\xbb\xbf", b"\xef\xbb\xbfacc\r\n"])
def test_a_byte_order_mark_and_two_signs_at_the_end_of_a_line(
    run, models, fitted, piped, first
):
    samples = sound("good", 450, 3)
    piped(first + lines_of(samples).replace(b"\n", b"\r\n"))
    code, out, err = run("watch", models[0], "-")
    assert code == 0
    assert verdicts_of(out) == expected(fitted, samples)
    assert "no numbers" not in err


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            np.random.default_rng(0).bytes(100_000),
            "expected csv lines in UTF-8; raw samples need --dtype",
        ),
        (bytes(1_400_000), "bytes without a line of numbers, expected csv lines"),
        (b"1" * 1_400_000, "bytes without a line of numbers, expected csv lines"),
        (
            b"<html>\n<p>Not found\n</p>\n</html>\n",
            "'<p>Not found' is no line of 1 numbers",
        ),
        ("1.5\n2.5\n".encode("utf-16"), "expected csv lines in UTF-8"),
        (b"1.5,5\n" * 300, "2 channels, expected 1; --channel chooses"),
    ],
)
def test_what_is_no_text_with_numbers(run, models, piped, data, message):
    piped(data)
    code, out, err = run("watch", models[0], "-")
    assert code == 1 and out == "" and "error: -: " in err and message in err


def test_the_layout_does_not_depend_on_how_the_lines_come():
    data = b"1 2\n" * 6 + b"3,4\n" * 70
    whole = parsed(text_samples(), data)
    pieces = text_samples()
    parts = [parsed(pieces, data[i : i + 5]) for i in range(0, len(data), 5)]
    np.testing.assert_array_equal(
        np.concatenate([p for p in parts if p.size], axis=1), whole
    )
    assert whole[:, 0].tolist() == [1.0, 2.0]
    assert pieces.unread["lines that are no numbers"] == 70


def test_a_line_without_an_end_takes_no_memory():
    parser, noise = text_samples(), b"7" * 2**18
    assert parsed(parser, b"1\n2\n3\n4\n").shape == (1, 4)
    with pytest.raises(ContentError, match="1310720 bytes without a line of numbers"):
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
    path, steps = tmp_path / "log.csv", ["remove", "pipe", "folder", "file", "", ""]
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
    blocks = drained(
        from_growing_file(path, text_samples(), messages.append), act, len(steps)
    )
    assert [block.samples.tolist() for block in blocks] == [
        [[1, 2, 3, 4]],
        [[5, 6, 7, 8]],
    ]
    assert messages == [f"{path} was started afresh"]


def test_a_state_belongs_to_its_source(run, models, tmp_path):
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    samples = sound("good", 2000, 3)
    path.write_bytes(lines_of(samples[:500]))
    options = (*IDLE, "--state", state)
    assert len(verdicts_of(run("watch", models[0], path, *options)[1])) == 2
    saved = state.read_bytes()
    other = tmp_path / "other.csv"
    other.write_bytes(lines_of(samples))
    code, out, err = run("watch", models[0], other, *options)
    assert code == 1
    assert out == ""
    assert f"state of source '{path.resolve()}', expected" in err
    for option, value, message in (
        ("--channel", "0", "of channel None, expected '0'"),
        ("--time-column", "none", "of time column None, expected 'none'"),
        ("--dtype", "<f4", "of dtype None, expected '<f4'"),
    ):
        code, out, err = run("watch", models[0], path, *options, option, value)
        assert code == 1 and out == "" and message in err
        assert state.read_bytes() == saved
    # While nobody watched, the log was rotated: the new one is read from its beginning.
    path.rename(tmp_path / "log.1")
    path.write_bytes(lines_of(samples[500:1500]))
    code, out, err = run("watch", models[0], path, *options)
    assert code == 0 and "was started afresh since the state was saved" in err
    assert [v["start"] for v in verdicts_of(out)] == list(range(400, 1300, 200))


def test_a_file_that_was_truncated_and_rewritten_longer_is_read_from_its_beginning(
    run, models, tmp_path
):
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    options = (*IDLE, "--state", state)
    path.write_bytes(lines_of(sound("good", 500, 3)))
    assert len(verdicts_of(run("watch", models[0], path, *options)[1])) == 2
    # The same file, longer than before, with other contents.
    with path.open("wb") as file:
        file.write(lines_of(sound("worn", 1000, 4)))
    code, out, err = run("watch", models[0], path, *options)
    assert code == 0 and "was started afresh since the state was saved" in err
    # 100 samples waited, and all 1000 of the new file were read.
    assert [v["start"] for v in verdicts_of(out)] == list(range(400, 1400, 200))
    # A file that only grew is continued.
    with path.open("ab") as file:
        file.write(lines_of(sound("worn", 200, 5)))
    code, out, err = run("watch", models[0], path, *options)
    assert code == 0 and "afresh" not in err and len(verdicts_of(out)) == 1


@pytest.mark.parametrize("position", [7, "here", [1], ["a", 1]])
def test_a_position_that_is_none(run, models, fitted, tmp_path, position):
    path, state = tmp_path / "log.csv", tmp_path / "state.json"
    path.write_bytes(lines_of(sound("good", 450, 3)))
    monitor = ConditionMonitor(fitted[0], RATE, window_length=WINDOW)
    save_monitor_state(monitor, state, position=position)
    code, out, err = run("watch", models[0], path, *IDLE, "--state", state)
    assert code == 1
    assert out == ""
    assert (
        f"state.json: the position in the source is {position!r}, expected two values"
        in err
    )


def test_a_state_that_cannot_be_written_is_reported_at_once(
    run, models, piped, tmp_path
):
    piped(lines_of(sound("good", 450, 3)))
    code, out, err = run(
        "watch", models[0], "-", "--state", tmp_path / "nowhere" / "state.json"
    )
    assert code == 1 and out == "" and "nowhere" in err


def test_a_request_to_end_waits_for_the_end_of_a_file(
    run, models, tmp_path, monkeypatch
):
    """The state holds whole files: a later run reads none twice, and none in part."""
    folder, state = tmp_path / "logger", tmp_path / "state.json"
    folder.mkdir()
    np.save(folder / "a.npy", sound("good", 1000, 3))
    monkeypatch.setattr("skarxlag.recordings.live.block_length", lambda length: length)
    written = []

    def write(self, verdicts, source):
        written.extend(verdicts)
        if len(written) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("skarxlag.commands.watch_stream.SensorStream._report", write)
    run("watch", models[0], folder, *IDLE, "--state", state)
    assert len(written) == 5
    run("watch", models[0], folder, *IDLE, "--state", state)
    assert len(written) == 5


def test_a_column_of_shaft_speeds(run, models, piped, tmp_path):
    signal, rpm = sound("good", 1000, 3), np.repeat([900.0, 905.5], 500)
    for header, column in (
        (b"acc,n\n", "n"),
        (b"acc,speed of shaft\n", "speed*"),
        (b"", "1"),
    ):
        piped(header + lines_of(np.stack([signal, rpm])))
        code, out, err = run("watch", models[0], "-", "--rpm-column", column)
        found = verdicts_of(out)
        assert code == 0 and [v["rpm"] for v in found] == [900.0] * 2 + [905.5] * 3, err
    piped(b"n,acc\n" + lines_of(np.stack([rpm, signal])))
    moved = verdicts_of(
        run("watch", models[0], "-", "--rpm-column", "n", "--channel", "acc")[1]
    )
    assert moved == found
    piped(lines_of(signal))
    code, _, err = run("watch", models[0], "-", "--rpm-column", "n")
    assert code == 1 and "-: no channel 'n'" in err
    for source, *extra in ((tmp_path,), ("-", "--dtype", "<f4")):
        code, _, err = run("watch", models[0], source, "--rpm-column", "n", *extra)
        assert code == 2 and "--rpm-column: belongs to csv lines" in err
    code, _, err = run("watch", models[0], "-", "--rpm-column", "n", "--rpm", 900)
    assert code == 2 and "not allowed with argument" in err
    code, _, err = run("watch", models[0], "-", "--rpm", "log.csv")
    assert code == 2
    assert "--rpm: log.csv is for a folder; use tacho:CHANNEL, --rpm-column" in err
