"""Times that a stream states, in ``watch``."""

import json
import os
from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest

from skarxlag import ConditionMonitor
from skarxlag.recordings.formats._contents import ContentError
from skarxlag.recordings.live_text import TextSamples
from skarxlag.recordings.live_times import StreamTimes
from tests.commands.watching import (
    IDLE,
    RATE,
    WINDOW,
    expected,
    lines_of,
    sound,
    verdicts_of,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

START = datetime(2026, 11, 22, 7, tzinfo=UTC)


def timed(times, signal, header=b"time,acc\n"):
    return header + b"".join(
        f"{time},{value!r}\n".encode()
        for time, value in zip(times, signal.tolist(), strict=True)
    )


def dates(seconds):
    return [(START + timedelta(seconds=s)).isoformat() for s in seconds.tolist()]


def parser(column=None, rate=RATE, tolerance=0.1):
    return TextSamples(None, StreamTimes(column, rate, tolerance, WINDOW))


def test_a_gap_across_lines_is_a_gap_of_the_record(run, models, fitted, piped):
    signal = sound("good", 1000, 3)
    times = 5 + np.arange(1000) / RATE
    times[500:] += 7.5
    in_two = [
        datetime.fromisoformat(date).strftime("%d.%m.%Y,%H:%M:%S.%f")
        for date in dates(times)
    ]
    for written, start, header in [
        (times, 0.0, b"time,acc\n"),
        (dates(times), START.timestamp(), b"time,acc\n"),
        (in_two, START.timestamp(), b"Date,Time,acc\n"),
    ]:
        piped(timed(written, signal, header))
        code, out, err = run("watch", models[0], "-")
        monitor = ConditionMonitor(
            fitted[0], RATE, detector=fitted[1], window_length=WINDOW
        )
        wanted = monitor.update(signal[:500], time=5.0) + monitor.update(
            signal[500:], time=13.0
        )
        found = verdicts_of(out)
        assert code == 0 and "1 gap of 7.5 s" in err
        assert [v["start"] for v in found] == [0, 200, 500, 700]
        assert [v["time"] - start for v in found] == pytest.approx(
            [v.time for v in wanted], abs=1e-6
        )
        assert [v["probability"] for v in found] == pytest.approx(
            [v.probability for v in wanted]
        )


def test_times_are_equal_however_the_lines_come():
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.normal(1 / RATE, 1e-4, size=25_000)) + np.repeat(
        [0, 3.0], 12_500
    )
    data = timed(np.round(times, 5), rng.normal(size=25_000))

    def parsed_in_parts(size):
        stream, place, found = parser(), 0, []
        for start in range(0, len(data), size):
            for samples, time in stream.parts(data[start : start + size]):
                if time is not None:
                    found.append((place, time))
                place += samples.shape[1]
        return found

    whole = parsed_in_parts(len(data))
    assert whole == parsed_in_parts(1000) == parsed_in_parts(33_333)
    places = [place for place, _ in whole]
    # Once in a second, and the leap.
    assert places == [*range(0, 12_500, 1000), *range(12_500, 25_000, 1000)]
    assert [time for _, time in whole] == np.round(times, 5)[places].tolist()


@pytest.mark.parametrize("factor", [0.5, 0.95, 1.05, 2.0])
def test_times_of_another_rate_end_the_command(run, models, piped, factor):
    piped(timed(np.arange(3000) / (factor * RATE), sound("good", 3000, 3)))
    code, out, err = run("watch", models[0], "-")
    assert code == 1 and len(out.splitlines()) <= 1
    assert "-: " in err
    assert "samples take" in err
    assert "s at 1000 Hz: the sampling rate is another" in err


def test_the_clock_of_a_logger_drifts(run, models, piped):
    piped(
        timed(np.round(np.arange(30_000) / (1.004 * RATE), 6), sound("good", 30_000, 3))
    )
    code, out, err = run("watch", models[0], "-")
    assert code == 0 and "150 good; no gaps" in err
    assert verdicts_of(out)[-1]["time"] == pytest.approx(30 / 1.004, abs=5e-3)


def test_times_in_an_unstated_unit(run, models, piped):
    signal = sound("good", 700, 3)
    milliseconds = np.arange(700) + 0.5
    piped(timed(milliseconds, signal))
    code, out, err = run("watch", models[0], "-")
    assert code == 1
    assert out == ""
    assert "1 samples take 1 s by their times, expected 0.001" in err
    assert "time (ms)" in err
    piped(timed(milliseconds, signal, b"time (ms),acc\n"))
    code, out, err = run("watch", models[0], "-")
    assert code == 0 and verdicts_of(out)[0]["time"] == pytest.approx(0.2005)
    piped(timed(milliseconds, signal))
    code, out, err = run(
        "watch", models[0], "-", "--time-column", "none", "--channel", "acc"
    )
    assert code == 0 and verdicts_of(out)[0]["time"] == 0.2


def test_times_that_go_backwards(run, models, piped):
    times = np.arange(1000) / RATE
    times[430:] -= 300
    piped(timed(times + 1000.5, sound("good", 1000, 3)))
    code, out, err = run("watch", models[0], "-")
    found = verdicts_of(out)
    assert code == 0 and "clock steps back: 1" in err and "no gaps" in err
    assert [v["start"] for v in found] == [0, 200, 430, 630]
    assert found[2]["time"] == pytest.approx(1000.5 - 300 + 0.63)


@pytest.mark.parametrize("size", [100_000, 777])
def test_a_clock_that_stands_still(run, models, piped, size):
    """It would hide every gap. Times that are rounded to some seconds are right."""
    times = np.floor(np.arange(15_000) / RATE / 5) * 5
    list(parser(tolerance=5.0).parts(timed(times, np.ones(15_000))))
    stream, data = parser(), timed(np.full(15_000, 8.5), np.ones(15_000))
    with pytest.raises(
        ContentError, match=r"samples take 0 s by their times, expected 1"
    ):
        for start in range(0, len(data), size):
            list(stream.parts(data[start : start + size]))
    piped(timed(np.full(11_000, 8.5), sound("good", 11_000, 3)))
    code, _, err = run("watch", models[0], "-")
    assert code == 1 and "samples take 0 s by their times" in err


@pytest.mark.parametrize("size", [100_000, 777])
def test_times_that_fall(size):
    stream, data = parser(), timed(100 - np.arange(3000) / RATE, np.ones(3000))
    with pytest.raises(
        ContentError, match=r"samples take -0\.2 s by their times, expected 0\.2"
    ):
        for start in range(0, len(data), size):
            list(stream.parts(data[start : start + size]))


def test_times_in_minutes(run, models, piped):
    times = [f"{t:.9f}" for t in np.arange(700) / RATE / 60]
    piped(timed(times, sound("good", 700, 3), b"time (min),acc\n"))
    code, out, err = run("watch", models[0], "-")
    assert code == 0 and "no gaps" in err
    assert verdicts_of(out)[0]["time"] == pytest.approx(0.2, abs=1e-6)


def test_times_that_cannot_be_read_are_counted(run, models, piped):
    signal = sound("good", 700, 3)
    times = [f"{t:.3f}" for t in 4 + np.arange(700) / RATE]
    for k, text in (
        (0, "22 Nov 2026"),
        (250, ""),
        (251, "NaN"),
        (252, "1e308"),
        (300, "later"),
    ):
        times[k] = text
    piped(timed(times, signal))
    code, out, err = run("watch", models[0], "-")
    assert code == 0
    assert "times that could not be read: 5" in err
    assert "3 good; no gaps" in err
    assert [v["time"] for v in verdicts_of(out)] == pytest.approx([4.2, 4.4, 4.6])


def test_rounded_times_are_no_gaps():
    times = np.floor(np.arange(12_000) / RATE + 0.7) + 100
    found = list(parser("time", tolerance=1.0).parts(timed(times, np.ones(12_000))))
    assert (found[0][0].shape[1], found[0][1]) == (1300, 100.0)
    stated = np.cumsum([0] + [s.shape[1] for s, _ in found])[:-1] / RATE + 100.7
    # The first time is rounded down, and nothing before it shows by how much. Later
    # ones are exact.
    assert [t for _, t in found[1:]] == pytest.approx(stated[1:])


def test_which_column_holds_times(run, models, fitted, piped):
    signal = sound("good", 450, 3)
    clock = 50 + np.arange(450) / RATE
    columns = lines_of(np.stack([signal, clock]))
    piped(b"acc,clock\n" + columns)
    options = ("--channel", "acc")
    assert verdicts_of(run("watch", models[0], "-", *options)[1]) == expected(
        fitted, signal
    )
    for column in ("clock", "1", "cl*"):
        piped(b"acc,clock\n" + columns)
        found = run("watch", models[0], "-", *options, "--time-column", column)[1]
        assert verdicts_of(found)[0]["time"] == pytest.approx(50.2)
    # Whole numbers may count samples: they are times only on request.
    piped(b"time,acc\n" + lines_of(np.stack([np.arange(450.0), signal])))
    assert verdicts_of(run("watch", models[0], "-")[1])[0]["time"] == 0.2
    piped(b"acc,clock\n" + columns)
    code, _, err = run("watch", models[0], "-", *options, "--time-column", "watch")
    assert code == 1 and "-: no channel 'watch'; available: 'acc', 'clock'" in err
    code, _, err = run("watch", models[0], "-", "--dtype", "<i2", "--time-column", "0")
    assert code == 2 and "--time-column: belongs to csv lines" in err


def test_a_unit_that_is_none():
    with pytest.raises(
        ContentError, match="column 'time' is in 'weeks', expected one of"
    ):
        list(parser("time").parts(b"time;acc\nweeks;g\n0.1;1\n0.2;2\n"))
    found = list(parser().parts(b"time;acc\nweeks;g\n0.1;1\n0.2;2\n"))
    assert [time for _, time in found] == [None]


def test_whole_numbers_are_no_dates():
    found = list(
        parser("time*").parts(b"time (ms);acc\n" + b"10101010;1\n10101011;2\n" * 2)
    )
    assert found[0][1] == pytest.approx(10_101.010)


def test_files_that_state_dates(run, models, tmp_path):
    """A date in a file counts more than the time at which it was copied."""
    for number, start in enumerate([0.0, 1.0, 9.0]):
        seconds = start + np.arange(1000) / RATE
        values = sound("good", 1000, number)
        if number == 1:
            times = pd.Timestamp("2026-11-22 07:00") + pd.to_timedelta(
                seconds, unit="s"
            )
            path = tmp_path / "1.parquet"
            pd.DataFrame({"time": times, "acc": values}).to_parquet(path)
        else:
            path = tmp_path / f"{number}.csv"
            path.write_bytes(timed(dates(seconds), values))
        os.utime(path, (5000 + number, 5000 + number))
    code, out, err = run(
        "watch", models[0], tmp_path, *IDLE, "--timed-files", "--channel", "acc"
    )
    assert code == 0 and "15 good; 1 gap of 7.0 s" in err
    found = [v["time"] - START.timestamp() for v in verdicts_of(out)]
    assert found[::5] == pytest.approx([0.2, 1.2, 9.2], abs=1e-5)


def test_columns_of_times_belong_to_lines(run, models, tmp_path):
    code, _, err = run("watch", models[0], tmp_path, "--time-column", "time")
    assert code == 2 and "--time-column: belongs to csv lines" in err


@pytest.mark.parametrize("start", [START.timestamp(), 50.0])
def test_each_line_states_sensor_date_and_speed(run, models, piped, start):
    signal, before = sound("good", 450, 3), datetime.now(UTC)
    for options, sensor in (((), "diagnoser"), (("--sensor", "pump 7"), "pump 7")):
        piped(timed(start + np.arange(450) / RATE, signal))
        code, out, _ = run("watch", models[0], "-", "--rpm", 900, *options)
        lines = [json.loads(line) for line in out.splitlines()]
        assert code == 0
        assert {(line["sensor"], line["rpm"]) for line in lines} == {(sensor, 900.0)}
        assert [line["seconds"] - start for line in lines] == pytest.approx(
            [0.2, 0.4], abs=1e-6
        )
        assert not any(" " in name for line in lines for name in line)
        dates = [datetime.fromisoformat(line["time"]) for line in lines]
        if start == 50.0:
            # The clock of the source states no date.
            assert before - timedelta(seconds=1) <= dates[0] <= datetime.now(UTC)
        else:
            assert [(date - START).total_seconds() for date in dates] == [0.2, 0.4]


def test_a_heartbeat_while_nothing_comes(run, models, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(lines_of(sound("good", 250, 3)))
    options = ("--idle", 0.8, "--poll", 0.005, "--heartbeat", 0.2)
    lines = [
        json.loads(line)
        for line in run("watch", models[0], path, *options)[1].splitlines()
    ]
    kinds = [line["kind"] for line in lines]
    assert kinds.count("verdict") == 1 and 2 <= kinds.count("heartbeat") <= 5
    last = lines[-1]
    assert last["kind"] == "heartbeat" and 0.2 < last["seconds_without_window"] < 2
    found = [last[name] for name in ("sensor", "healthy", "verdict", "alarm")]
    assert found == ["log", "good", "good", False]
