"""Pages of ``skarxlag trend``: results and logs over time."""

import json
import re
import shutil
from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest

from skarxlag.plant.commands import main
from tests.plant.commands.pages import captions, text_of
from tests.plant.commands.watching import RATE, lines_of, sound

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

START = datetime(2026, 11, 1, tzinfo=UTC)


def line(hours, sensor="pump", kind="verdict", **fields):
    """Line of a log of watch."""
    time = (START + timedelta(hours=hours)).isoformat(timespec="milliseconds")
    usual = {"healthy": "good", "model": "a1", "verdict": "good", "probability": 0.9}
    usual |= {"alarm": False, "alarm_level": 0.1, "p_value": 0.5}
    return json.dumps({"kind": kind, "time": time, "sensor": sensor} | usual | fields)


@pytest.fixture
def page_of(run, tmp_path):
    """Return the page of some files."""

    def trend(*paths, options=()):
        output = tmp_path / "trend.html"
        code, out, err = run("trend", *paths, *options, "-o", output)
        assert code == 0 and out == f"Written: {output}\n", err
        return output.read_text()

    return trend


def test_a_log_of_weeks_is_drawn_with_its_events(page_of, tmp_path):
    """A fault after 20 days raises the alarm; it is acknowledged; the model changes."""
    path = tmp_path / "watch.jsonl"
    worn = {"verdict": "worn", "alarm": True, "alarm_level": 1.0, "p_value": 1e-4}
    lines = [line(hour) for hour in range(480)]
    lines += [line(hour, **worn) for hour in range(480, 500)]
    lines += [line(500, kind="acknowledged", **worn)]
    lines += [line(hour, verdict="worn") for hour in (501, 600)]
    lines += [line(hour, model="b2") for hour in range(601, 620)]
    path.write_text("\n".join(lines))
    page = page_of(path)
    text = text_of(page)
    assert "522 rows of watch.jsonl" in text
    assert captions(page) == [
        "Verdicts and alarm",
        "Alarm level (1 raises the alarm)",
        "p-value (power of ten)",
        "Probability of the verdict",
    ]
    assert "good: 499 of 521" in text and "worn: 22 of 521" in text
    assert "alarm: 20 of 521" in text
    newest_first = [
        "2026-11-26 01:00:00 verdict: good",
        "2026-11-26 01:00:00 another model: b2",
        "2026-11-26 00:00:00 no rows for 4 days 03:00:00",
        "2026-11-21 21:00:00 alarm off",
        "2026-11-21 20:00:00 alarm acknowledged",
        "2026-11-21 00:00:00 alarm on",
        "2026-11-21 00:00:00 verdict: worn",
        "2026-11-01 00:00:00 alarm off",
        "2026-11-01 00:00:00 verdict: good",
    ]
    assert text.endswith("Events: 9 " + " ".join(newest_first))
    assert len(page.encode()) < 100_000


def test_the_axis_of_a_sensor_ends_with_its_last_line(page_of, tmp_path):
    """Verdicts of the first day fill the beginning of an axis of 20 days."""
    path = tmp_path / "watch.jsonl"
    facts = {"kind": "heartbeat", "verdict": None, "problem": "a.npy: gone"}
    silent = [line(hour, **facts) for hour in (480, 481)]
    path.write_text("\n".join([*(line(hour) for hour in range(24)), *silent]))
    page = page_of(path)
    text = text_of(page)
    assert "05 Nov 12 Nov 19 Nov" in text
    # A problem is an event when it begins.
    assert text.count("2026-11-21 00:00:00 a.npy: gone") == 1
    assert "2026-11-21 01:00:00 a.npy" not in text
    (strip,) = re.findall('class="healthy area" d="(.*?)"', page)
    points = re.findall(r"[ML](\d+) (\d+)", strip)
    # 24 parts of 20 hours each.
    assert max(int(x) for x, y in points if y != "240") == round(1000 * 2 / 24)


def test_the_log_of_the_command_watch_is_read(run, models, piped, page_of, tmp_path):
    signal = np.concatenate([sound("good", 8000, 3), sound("worn", 4000, 4)])
    piped(lines_of(signal))
    code, out, _ = run("watch", models[0], "-", "--sensor", "<b>pump")
    assert code == 0
    path = tmp_path / "watch.jsonl"
    path.write_text(out)
    page = page_of(path)
    assert f"{len(signal) // 200} rows" in page
    assert "&lt;b&gt;pump" in page and "<b>pump" not in page
    assert {"Alarm level (1 raises the alarm)", "Probability of the verdict"} < {
        *captions(page)
    }


def test_sensors_have_a_section_each_and_alarms_come_first(page_of, tmp_path):
    path = tmp_path / "watch.jsonl"
    lines = [line(hour, sensor) for hour in range(5) for sensor in ("a", "b", "c")]
    lines += [line(5, "b", alarm=True)]
    # The last line was cut.
    path.write_text("\n".join(lines) + '\n{"kind": "verd')
    page = page_of(path)
    assert re.findall("<h2>(.*?)</h2>", page) == ["b", "a", "c"]
    assert re.findall('href="#(s.)">(.)</a>', page) == [
        ("s1", "b"),
        ("s2", "a"),
        ("s3", "c"),
    ]
    assert "16 rows" in page


@pytest.fixture(scope="module")
def diagnosed(models, tmp_path_factory):
    """Results of three recordings of two machines, and of a lost one."""
    folder = tmp_path_factory.mktemp("results")
    for number, condition in enumerate(["good", "worn", "good"]):
        np.save(folder / f"{number + 1}.npy", sound(condition, 4000, 5 + number))
    (folder / "table.csv").write_text(
        "path,date,machine\n"
        "1.npy,2026-10-01,fan\n2.npy,2026-10-08T12:00,fan\n3.npy,2026-10-02,pump\n"
        "lost.npy,2026-10-03,pump\n"
    )
    for suffix in ("csv", "json", "parquet"):
        output = folder / f"results.{suffix}"
        command = ["diagnose", models[0], "--table", folder / "table.csv", "-q"]
        options = ["--sampling-rate", RATE, "-o", output]
        assert main([str(argument) for argument in command + options]) == 1
    return folder


@pytest.fixture
def results(diagnosed, tmp_path):
    """Return the folder of a test, with a copy of the results."""
    shutil.copytree(diagnosed, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.mark.parametrize("suffix", ["csv", "json", "parquet"])
def test_results_of_diagnose_are_read(page_of, results, suffix):
    page = page_of(results / f"results.{suffix}")
    assert re.findall("<h2>(.*?)</h2>", page) == ["fan", "pump"]
    for event in (
        "2026-10-08 12:00:00 verdict: worn",
        "2026-10-01 00:00:00 verdict: good",
        "2026-10-03 00:00:00 verdict: no verdict",
    ):
        assert event in text_of(page)
    assert "Probability of the verdict" in captions(page)
    assert "Velocity RMS (mm/s)" not in captions(page)


def test_columns_of_time_and_sensor_can_be_chosen(page_of, results):
    options = ("--time", "file_time", "--sensor", "recording")
    page = page_of(results / "results.csv", options=options)
    # The lost file has no time, so it is left out.
    assert re.findall("<h2>(.*?)</h2>", page) == ["2.npy", "1.npy", "3.npy"]
    assert f"({datetime.now(UTC):%Y-%m-%d}" in page


def test_recordings_without_a_time_stand_in_the_order_of_the_files(page_of, results):
    rows = pd.read_csv(results / "results.csv")
    plain = rows.drop(columns=["stated_date", "file_time"])
    plain["velocity_rms_mm_s"] = [1, 2, 3, None]
    plain["alarm"] = ["no", "yes", "no", "-"]
    plain.to_csv(results / "plain.csv", index=False)
    page = page_of(results / "plain.csv", results / "plain.csv")
    text = text_of(page)
    assert (
        "8 rows of plain.csv, plain.csv" in text and "Number of the recording" in text
    )
    assert "recording 6 verdict: worn" in text and "alarm: 2 of 4" in text
    assert "Velocity RMS (mm/s)" in captions(page)


@pytest.mark.parametrize(
    ("content", "options", "expected"),
    [
        ("a,b\n1,2\n", (), "expected results of diagnose"),
        ("", (), "expected results of diagnose"),
        ('{"a": 1}\n', (), "expected results of diagnose"),
        ("recording,start,verdict,alarm,quality\n", (), "this is a table of windows"),
        ("recording,verdict,alarm,\n1,a,no,\n", ("--time", "x"), "no column x"),
        ("recording,verdict,\nx,a,\n", (), "no column alarm"),
        ("recording,verdict,alarm\nx,a,no\n", ("--time", "recording"), "no dates"),
    ],
)
def test_files_of_another_kind_are_refused(run, tmp_path, content, options, expected):
    path = tmp_path / "file.csv"
    path.write_text(content)
    output = tmp_path / "page.html"
    code, _, err = run("trend", path, *options, "-o", output)
    assert code == 1 and expected in err and str(path) in err and not output.exists()


def test_a_page_replaces_nothing_that_is_foreign(run, results):
    foreign = results / "notes.html"
    foreign.write_text("my notes")
    code, _, err = run("trend", results / "results.csv", "-o", foreign)
    assert (
        code == 2 and "--force replaces it" in err and foreign.read_text() == "my notes"
    )
    assert run("trend", results / "results.csv", "-o", foreign, "--force")[0] == 0
    assert run("trend", results / "results.csv", "-o", results / "results.csv")[0] == 2
    assert run("trend", results / "lost.csv")[0] == 1
