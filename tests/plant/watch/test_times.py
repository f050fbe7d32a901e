"""Times that a stream states, in ``watch``."""

import json
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from skarxlag import ConditionMonitor
from skarxlag.plant.watch.stream_times import StreamTimes
from tests.plant.watch.watching import (
    RATE,
    WINDOW,
    expected,
    lines_of,
    sound,
    text_parser,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

START = datetime(2026, 11, 22, 7, tzinfo=UTC)
SIGNAL = sound("good", 1000, 3)


def timed(times, signal=SIGNAL, header="time,acc"):
    """Lines of times and samples, as many as there are times."""
    rows = zip(times, signal.tolist(), strict=False)
    return "\n".join(
        [header, *(f"{time},{value!r}" for time, value in rows), ""]
    ).encode()


def dates(seconds):
    return [(START + timedelta(seconds=s)).isoformat() for s in seconds.tolist()]


def parser(column=None, tolerance=0.1):
    return text_parser(StreamTimes(column, RATE, tolerance, WINDOW))


def stated_times(stream, data, size=10**9):
    """Return the stated times of bytes that come in pieces of a size, and their samples."""
    stated = []
    n_before = 0
    for start in range(0, len(data), size):
        for samples, time in stream.parts(data[start : start + size], False):
            if time is not None:
                stated.append((n_before, time))
            n_before += samples.shape[1]
    return stated


GAP = 5 + np.arange(1000) / RATE + 7.5 * (np.arange(1000) >= 500)
TWO_COLUMNS = [
    datetime.fromisoformat(date).strftime("%d.%m.%Y,%H:%M:%S.%f") for date in dates(GAP)
]


@pytest.mark.parametrize(
    ("times", "start", "header"),
    [
        (GAP, 0.0, "time,acc"),
        (dates(GAP), START.timestamp(), "time,acc"),
        (TWO_COLUMNS, START.timestamp(), "Date,Time,acc"),
    ],
    ids=["seconds", "dates", "two columns"],
)
def test_a_gap_across_lines_is_a_gap_of_the_record(watch, fitted, times, start, header):
    code, verdicts, err = watch(timed(times, header=header))
    monitor = ConditionMonitor(
        fitted[0], RATE, detector=fitted[1], window_length=WINDOW
    )
    by_hand = monitor.update(SIGNAL[:500], time=5.0)
    by_hand += monitor.update(SIGNAL[500:], time=13.0)
    assert code == 0
    assert "1 gap of 7.5 s" in err
    assert [v["start"] for v in verdicts] == [0, 200, 500, 700]
    seconds = [v["time"] - start for v in verdicts]
    assert seconds == pytest.approx([v.time for v in by_hand], abs=1e-6)
    probabilities = [v["probability"] for v in verdicts]
    assert probabilities == pytest.approx([v.probability for v in by_hand])


def test_times_are_equal_however_the_lines_come():
    rng = np.random.default_rng(0)
    steps = rng.normal(1 / RATE, 1e-4, size=10_000)
    steps[5000] += 3
    times = np.round(np.cumsum(steps), 5)
    data = timed(times, rng.normal(size=10_000))
    whole = stated_times(parser(), data)
    for size in (777, 33_333):
        assert stated_times(parser(), data, size) == whole
    samples = [sample for sample, _ in whole]
    # Once in a second, and the leap.
    assert samples == list(range(0, 10_000, 1000))
    assert [time for _, time in whole] == times[samples].tolist()


@pytest.mark.parametrize("factor", [0.5, 0.95, 1.05, 2.0])
def test_times_of_another_rate_end_the_command(watch, factor):
    times = np.arange(3000) / (factor * RATE)
    code, verdicts, err = watch(timed(times, sound("good", 3000, 3)))
    assert code == 1
    assert len(verdicts) <= 1
    assert "-: " in err
    assert "samples take" in err
    assert "s at 1000 Hz: the sampling rate is another" in err


def test_the_clock_of_a_logger_drifts(watch):
    times = np.round(np.arange(15_000) / (1.004 * RATE), 6)
    code, verdicts, err = watch(timed(times, sound("good", 15_000, 3)))
    assert code == 0
    assert "75 good; no gaps" in err
    assert verdicts[-1]["time"] == pytest.approx(15 / 1.004, abs=5e-3)


def test_times_in_an_unstated_unit(watch):
    milliseconds = np.arange(700) + 0.5
    code, verdicts, err = watch(timed(milliseconds))
    assert code == 1
    assert verdicts == []
    assert "1 samples take 1 s by their times, expected 0.001" in err
    assert "time (ms)" in err
    ignored = ("--time-column", "none", "--channel", "acc")
    assert watch(timed(milliseconds), *ignored)[1][0]["time"] == 0.2


@pytest.mark.parametrize(
    ("unit", "scale", "first"), [("ms", 1000, 0.2005), ("min", 1 / 60, 0.2005)]
)
def test_times_in_a_stated_unit(watch, unit, scale, first):
    times = [f"{t:.9f}" for t in (np.arange(700) + 0.5) / RATE * scale]
    code, verdicts, err = watch(timed(times, header=f"time ({unit}),acc"))
    assert code == 0
    assert "no gaps" in err
    assert verdicts[0]["time"] == pytest.approx(first, abs=1e-6)


def test_times_that_go_backwards(watch):
    times = 1000.5 + np.arange(1000) / RATE - 300 * (np.arange(1000) >= 430)
    code, verdicts, err = watch(timed(times))
    assert code == 0
    assert "clock steps back: 1" in err
    assert "no gaps" in err
    assert [v["start"] for v in verdicts] == [0, 200, 430, 630]
    assert verdicts[2]["time"] == pytest.approx(1000.5 - 300 + 0.63)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (np.full(11_000, 8.5), r"samples take 0 s by their times, expected 1"),
        (100 - np.arange(3000) / RATE, r"samples take -0\.2 s .*, expected 0\.2"),
    ],
    ids=["a clock that stands still", "times that fall"],
)
@pytest.mark.parametrize("size", [10**9, 777])
def test_times_that_are_none(times, message, size):
    """They would hide every gap."""
    with pytest.raises(ValueError, match=message):
        stated_times(parser(), timed(times, np.ones(len(times))), size)


def test_times_that_are_rounded_to_some_seconds_are_right():
    times = np.floor(np.arange(15_000) / RATE / 5) * 5 + 0.5
    stated = stated_times(parser(tolerance=5.0), timed(times, np.ones(15_000)))
    assert stated == [(0, 0.5), (5000, 5.5), (10_000, 10.5)]


def test_samples_of_times_that_cannot_be_read_follow(watch):
    times = [f"{t:.3f}" for t in 4 + np.arange(700) / RATE]
    times[0] = "22 Nov 2026"
    times[250:253] = ["", "NaN", "1e308"]
    times[300] = "later"
    code, verdicts, err = watch(timed(times))
    assert code == 0
    assert "3 good; no gaps" in err
    assert [v["time"] for v in verdicts] == pytest.approx([4.2, 4.4, 4.6])


def test_rounded_times_are_no_gaps():
    times = np.floor(np.arange(12_000) / RATE + 0.7) + 100
    parts = stated_times(parser("time", tolerance=1.0), timed(times, np.ones(12_000)))
    assert parts[0] == (0, 100.0)
    assert parts[1][0] == 1300
    # The first time is rounded down, and nothing before it shows by how much. Later
    # ones are exact.
    for sample, time in parts[1:]:
        assert time == pytest.approx(sample / RATE + 100.7)


CLOCK = b"acc,clock\n" + lines_of([SIGNAL[:450], 50 + np.arange(450) / RATE])


@pytest.mark.parametrize("column", ["clock", "1", "cl*"])
def test_a_chosen_column_of_times(watch, column):
    options = ("--channel", "acc", "--time-column", column)
    assert watch(CLOCK, *options)[1][0]["time"] == pytest.approx(50.2)


def test_which_column_holds_times(watch, fitted):
    assert watch(CLOCK, "--channel", "acc")[1] == expected(fitted, SIGNAL[:450])
    # Whole numbers may count samples: they are times only on request.
    counted = b"time,acc\n" + lines_of([np.arange(450.0), SIGNAL[:450]])
    assert watch(counted)[1][0]["time"] == 0.2
    code, _, err = watch(CLOCK, "--channel", "acc", "--time-column", "watch")
    assert code == 1
    assert "-: no channel 'watch'; available: 'acc', 'clock'" in err


def test_a_unit_that_is_none():
    data = b"time;acc\nweeks;g\n0.1;1\n0.2;2\n"
    message = "column 'time' is in 'weeks', expected one of"
    with pytest.raises(ValueError, match=message):
        stated_times(parser("time"), data)
    assert stated_times(parser(), data) == []


def test_whole_numbers_are_no_dates():
    data = b"time (ms);acc\n" + b"10101010;1\n10101011;2\n" * 2
    assert stated_times(parser("time*"), data)[0][1] == pytest.approx(10_101.010)


@pytest.mark.parametrize("start", [START.timestamp(), 50.0])
@pytest.mark.parametrize("options", [(), ("--sensor", "pump 7")])
def test_each_line_states_sensor_date_and_speed(run, models, piped, start, options):
    before = datetime.now(UTC)
    piped(timed(start + np.arange(450) / RATE))
    code, out, _ = run("watch", models[0], "-", "--rpm", 900, *options)
    lines = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    sensor = "pump 7" if options else "diagnoser"
    assert {(line["sensor"], line["rpm"]) for line in lines} == {(sensor, 900.0)}
    seconds = [line["seconds"] - start for line in lines]
    assert seconds == pytest.approx([0.2, 0.4], abs=1e-6)
    assert not any(" " in name for line in lines for name in line)
    moments = [datetime.fromisoformat(line["time"]) for line in lines]
    if start == 50.0:
        # The clock of the source states no date.
        assert before - timedelta(seconds=1) <= moments[0] <= datetime.now(UTC)
    else:
        assert [(m - START).total_seconds() for m in moments] == [0.2, 0.4]
