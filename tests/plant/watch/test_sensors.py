"""Several sensors in one process, their states and their alarms, in ``watch``."""

import contextlib
import json
import os
import signal
import threading
import time
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from skarxlag import ConditionMonitor, load_monitor_state, save_monitor_state
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.watch import sensors
from tests.plant.watch.watching import (
    IDLE,
    RATE,
    WINDOW,
    expected,
    lines_of,
    save_model,
    sound,
)

pytestmark = [
    pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning"),
    pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes"),
]
LOOK = (*IDLE, "--retry", 1e-9)


@pytest.fixture
def plant(model, tmp_path):
    """A table of three folders with a snapshot each, of another signal."""
    columns = {"name": ["a", "b", "c"], "source": ["da", "db", "dc"]}
    for number, name in enumerate(columns["source"]):
        drop(tmp_path / name, 3 * WINDOW, number)
    # Spreadsheets of many countries separate by semicolons.
    table = pd.DataFrame(columns | {"model": model, "rpm": [900, 901, ""]})
    table.to_csv(tmp_path / "plant.csv", index=False, sep=";")
    return tmp_path / "plant.csv"


def drop(folder, n_samples, seed, gain=1.0):
    folder.mkdir(exist_ok=True)
    number = len([*folder.iterdir()])
    np.save(folder / f"{number}.npy", gain * sound("good", n_samples, seed))


def change(path, **columns):
    table = pd.read_csv(path, sep=";").astype(object).assign(**columns)
    table.to_csv(path, index=False)


def of_kind(out, kind="verdict"):
    """Lines of a kind, by sensor."""
    found = {}
    for line in map(json.loads, out.splitlines()):
        if line["kind"] == kind:
            found.setdefault(line["sensor"], []).append(line)
    return found


@pytest.fixture
def during(monkeypatch):
    """Set what happens in the pauses of the command, in turn; a signal ends it."""

    def play(*actions):
        steps = [*actions, *[lambda: None] * 8]

        def pause(seconds):
            threading.Event().wait(0.02)
            if steps:
                steps.pop(0)()
            else:
                signal.raise_signal(signal.SIGINT)

        clock = SimpleNamespace(monotonic=time.monotonic, time=time.time, sleep=pause)
        monkeypatch.setattr(sensors, "time", clock)

    return play


def test_each_sensor_has_its_verdicts_and_a_model_is_loaded_once(
    run, plant, fitted, monkeypatch
):
    loaded, saved_model = [], sensors.SavedModel

    def load(path):
        loaded.append(path)
        return saved_model(path)

    monkeypatch.setattr(sensors, "SavedModel", load)
    code, out, err = run("watch", plant, *IDLE)
    assert code == 0 and len(loaded) == 1
    found = of_kind(out)
    assert {name: len(lines) for name, lines in found.items()} == {
        "a": 1, "b": 1, "c": 1,
    }  # fmt: skip
    assert len({lines[0]["probability"] for lines in found.values()}) == 3
    for name in "abc":
        assert f"{name}: last: good; alarm: off" in err


def test_pipes_of_one_model_have_the_verdicts_of_each_alone(run, plant, during):
    signals = [sound("good", 3 * WINDOW, 3), 50 * sound("good", 3 * WINDOW, 4)]
    ends = []
    for name in ("pa", "pb"):
        os.mkfifo(plant.parent / name)
        ends.append(os.open(plant.parent / name, os.O_RDWR))
    change(plant, source=["pa", "pb", "dc"], rpm=900)

    def write(half):
        for end, one in zip(ends, signals, strict=True):
            os.write(end, lines_of(np.split(one, 2)[half]))

    during(lambda: None, lambda: write(0), lambda: None, lambda: write(1))
    code, out, _ = run("watch", plant)
    for end in ends:
        os.close(end)
    model = sensors.SavedModel(pd.read_csv(plant)["model"][0])
    found = of_kind(out)
    assert code == 0
    for name, one in zip("ab", signals, strict=True):
        alone = expected((model.diagnoser, model.detector), one)
        assert [v["verdict"] for v in found[name]] == [v["verdict"] for v in alone]
        assert [v["p_value"] for v in found[name]] == [v["p_value"] for v in alone]
        assert [v["rpm"] for v in found[name]] == [900.0] * 3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": None}, "expected a name without slashes, a source and a model"),
        ({"rpm": ["900", "fast", "1"]}, "line 3: rpm is 'fast', expected a positive"),
        ({"name": ["a", "b", "a"]}, "two sensors of the name 'a'"),
        ({"speed": 1}, "expected name, source, model, and if needed channel, rpm"),
    ],
)
def test_a_table_with_a_mistake_ends_the_command(run, plant, changes, message):
    change(plant, **changes)
    code, out, err = run("watch", plant, *IDLE)
    assert code == 1 and out == "" and message in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("column", "cell", "message"),
    [
        ("source", "gone", "gone: no such file or folder"),
        ("source", "plant.csv", "plant.csv is a file; tail -n +1 -F"),
        ("model", "gone.skops", "gone.skops"),
        ("model", "plant.csv", "plant.csv: no diagnoser saved by skarxlag"),
    ],
)
def test_a_sensor_that_cannot_be_watched_does_not_keep_the_others_from_it(
    run, plant, column, cell, message
):
    cells = pd.read_csv(plant, sep=";")[column].tolist()
    change(plant, **{column: [cells[0], cell, cells[2]]})
    code, out, err = run("watch", plant, *LOOK, "--heartbeat", 0.01)
    assert code == 1 and "Traceback" not in err
    assert of_kind(out).keys() == {"a", "c"}
    # It is tried again in each pass, and reported once.
    (line,) = (line for line in err.splitlines() if "error" in line)
    assert message in line and "tried again every 1e-09 s" in line
    for beat in of_kind(out, "heartbeat")["b"]:
        assert message in beat["problem"]
        assert beat["verdict"] is beat["alarm"] is beat["healthy"] is None


def test_a_source_that_vanishes_and_comes_back_continues(run, plant, during):
    folder = plant.parent / "db"
    moved = plant.parent / "moved"
    change(plant, rpm=900)
    during(
        *[lambda: None] * 3,
        lambda: folder.rename(moved),
        *[lambda: None] * 3,
        lambda: moved.rename(folder),
        lambda: drop(folder, 3 * WINDOW, 9),
    )
    code, out, err = run("watch", plant, "--settle", 0.01, "--retry", 1e-9)
    assert code == 0
    # No file is diagnosed twice.
    assert [line["source"] for line in of_kind(out)["b"]] == ["0.npy", "1.npy"]
    errors = [line for line in err.splitlines() if line.startswith("b: error: ")]
    assert 1 <= len(errors) == len({*errors}) and err.count("b: watched again") == 1
    assert len(of_kind(out)["a"]) == 1


def test_a_pipe_that_fails_is_tried_again_without_a_thread_for_each_attempt(
    run, plant, during
):
    os.mkfifo(plant.parent / "pipe")
    change(plant, source=["da", "pipe", "dc"], rpm=900)
    pipe = os.open(plant.parent / "pipe", os.O_RDWR | os.O_NONBLOCK)
    n_before = threading.active_count()

    def append():
        with contextlib.suppress(BlockingIOError):
            os.write(pipe, b"1.0,2.0\n" * 200)

    during(*[append] * 6)
    code, _, err = run("watch", plant, "--settle", 0.01, "--retry", 1e-9)
    assert code == 1 and err.count("b: error: ") == 1
    assert "2 channels, expected 1" in err
    end = time.monotonic() + 30
    while threading.active_count() > n_before + 1 and time.monotonic() < end:
        # Those that wait for the pipe end with what it holds next.
        append()
        threading.Event().wait(0.01)
    os.close(pipe)
    assert time.monotonic() < end


def test_a_pipe_of_a_table_that_its_writer_closes_is_opened_again(run, plant, during):
    path = plant.parent / "pipe"
    os.mkfifo(path)
    change(plant, source=["da", "pipe", "dc"], rpm=900)

    def write(seed):
        def start():
            content = lines_of(sound("good", WINDOW, seed))
            threading.Thread(target=path.write_bytes, args=(content,)).start()

        return start

    nothing = [lambda: None] * 5
    during(write(3), *nothing, write(4), *nothing)
    _, out, err = run("watch", plant, "--settle", 0.01, "--retry", 1e-9)
    assert [line["start"] for line in of_kind(out)["b"]] == [0, 200]
    assert "pipe: the pipe has ended" in err and "b: watched again" in err


def test_a_pipe_continues_after_the_pause(run, model, piped, tmp_path, monkeypatch):
    state = tmp_path / "state.json"
    for seed, n_samples in enumerate((550, 450)):
        piped(lines_of(sound("good", n_samples, seed)))
        code, out, _ = run("watch", model, "-", "--state", state)
        assert code == 0
        # The incomplete window of the run before is left out.
        starts = [line["start"] for line in of_kind(out)["m"]]
        assert starts == [[0, 200], [550, 750]][seed]
        later = time.time() + 60
        monkeypatch.setattr(sensors.time, "time", lambda later=later: later)
    # The state belongs to its source.
    saved = state.read_bytes()
    code, out, err = run("watch", model, tmp_path, "--state", state)
    assert code == 1 and out == "" and f"a state of -, expected {tmp_path}" in err
    assert state.read_bytes() == saved


@pytest.mark.parametrize("content", [b"damaged", b'{"format": "skarxlag monitor 1"}'])
def test_a_state_that_cannot_be_read_concerns_its_sensor(run, plant, content):
    states = plant.parent / "states"
    states.mkdir()
    (states / "b.json").write_bytes(content)
    code, out, err = run("watch", plant, *LOOK, "--state", states)
    assert code == 1 and of_kind(out).keys() == {"a", "c"}
    assert err.count("b: error: ") == 1 and "b.json: no state of a monitor" in err
    assert (states / "b.json").read_bytes() == content


def test_a_state_of_another_model_or_of_other_settings_starts_afresh(
    run, fitted, tmp_path
):
    path, folder = tmp_path / "model.skops", tmp_path / "da"

    def watched(*options):
        latched = ("--latch", *IDLE, "--state", tmp_path / "state.json")
        code, out, err = run("watch", path, folder, *latched, *options)
        assert code == 0
        return of_kind(out)["da"], err

    save_model(fitted[0], path, 2)
    for seed in (3, 4):
        drop(folder, 10 * WINDOW, seed, gain=50)
    assert watched("--alarm-delay", 2)[0][-1]["alarm"]
    # Files are not diagnosed again, and somebody has to acknowledge the alarm.
    for source, reason in (
        ("2.npy", "alarm == "),
        ("3.npy", "the state is of another model"),
    ):
        drop(folder, 10 * WINDOW, 4)
        (line,), err = watched()
        assert f"start afresh: {reason}" in err
        assert (line["source"], line["alarm_state"]) == (source, "latched")
        save_model(fitted[0], path, 7)


def test_an_alarm_is_latched_until_it_is_acknowledged(run, plant):
    states = plant.parent / "states"
    options = ("watch", plant, *IDLE, "--latch", "--state", states)

    def watched(gain, n_files):
        for seed in range(n_files):
            drop(plant.parent / "da", 10 * WINDOW, 20 + seed, gain)
        code, out, _ = run(*options)
        assert code == 0
        return [line["alarm_state"] for line in of_kind(out)["a"]][-n_files:]

    assert watched(50, 1) == ["on"]
    assert watched(1, 8)[-1] == "latched"
    for _ in range(2):
        code, out, err = run("acknowledge", states / "a.json")
        assert code == 0 and out == "" and "acknowledged when watch looks" in err
    assert watched(1, 2) == ["off"] * 2
    assert {path.suffix for path in states.iterdir()} == {".json"}
    code, _, err = run("acknowledge", states / "gone.json")
    assert code == 1 and "gone.json: no such file" in err


def test_an_alarm_is_acknowledged_while_it_is_watched(run, plant, during):
    drop(plant.parent / "da", 10 * WINDOW, 30, gain=50)
    for seed in range(8):
        drop(plant.parent / "da", 10 * WINDOW, 31 + seed)
    state = plant.parent / "states" / "a.json"
    codes = []
    during(*[lambda: None] * 4, lambda: codes.append(run("acknowledge", state)[0]))
    options = ("--latch", "--settle", 0.01, "--state", state.parent)
    code, out, err = run("watch", plant, *options, "--heartbeat", 1e-3)
    assert codes == [0] and code == 0
    assert err.count("a: The alarm was acknowledged, and is off.") == 1
    (line,) = of_kind(out, "acknowledged")["a"]
    assert (line["alarm"], line["alarm_state"]) == (False, "off")
    later = of_kind(out, "heartbeat")["a"][-1]
    assert later["alarm"] is False and later["verdict"] == "good"


def test_a_note_of_an_acknowledgement_does_not_follow_a_link(run, plant):
    drop(plant.parent / "da", 10 * WINDOW, 30, gain=50)
    states = plant.parent / "states"
    run("watch", plant, *IDLE, "--latch", "--state", states)
    (states / "a.json.acknowledge").symlink_to(plant.parent / "target")
    run("acknowledge", states / "a.json")
    assert not (plant.parent / "target").exists()


def test_verdicts_go_on_while_the_state_cannot_be_saved(
    run, plant, during, monkeypatch
):
    """A full disk is reported once, and tried again."""
    monkeypatch.setattr(sensors, "_SAVE_EVERY", 0.0)
    is_full = [False]

    def save_state(*arguments, **facts):
        if is_full:
            raise OSError(28, "No space left on device")
        save_monitor_state(*arguments, **facts)

    monkeypatch.setattr(sensors, "save_monitor_state", save_state)
    late = plant.parent / "da"
    during(*[lambda: None] * 3, lambda: drop(late, 3 * WINDOW, 8), is_full.clear)
    options = ("--settle", 0.01, "--state", plant.parent / "states")
    code, out, err = run("watch", plant, *options)
    assert code == 0 and len(of_kind(out)["a"]) == 2
    message = "a: error: the state is not saved, tried every minute: [Errno 28]"
    assert err.count(message) == 1
    names = load_monitor_state(plant.parent / "states" / "a.json")[1]["names"]
    assert names == ["0.npy", "1.npy"]
    is_full.append(True)
    assert run("watch", plant, *IDLE, *options)[0] == 1


def test_the_delay_of_a_pipe_follows_from_the_interval(run, model, piped):
    delays = {}
    for option, value in (
        *(("--false-alarm-interval", hours) for hours in (1, 1000)),
        ("--alarm-delay", 5),
    ):
        piped(lines_of(50 * sound("good", 40 * WINDOW, 30)))
        _, out, err = run("watch", model, "-", option, value)
        delay = [line["alarm"] for line in of_kind(out)["m"]].index(True) + 1
        delays[value] = delay
        assert (
            f"Alarm: after {delay} consecutive windows beyond the healthy limits" in err
        )
        assert f"({0.2 * delay:.3g} s of signal)" in err
        stated = float(err.split("at most one in ")[1].split()[0])
        if option != "--alarm-delay":
            assert stated >= value
    assert 1 < delays[1] < delays[1000] and delays[5] == 5
    options = ("--alarm-delay", 3, "--false-alarm-interval", 9)
    code, _, err = run("watch", model, "-", *options)
    assert code == 2 and "not allowed with argument" in err


def test_the_time_that_a_model_takes_to_load_is_not_idle(
    run, model, tmp_path, monkeypatch
):
    path, saved_model = tmp_path / "pipe", sensors.SavedModel

    def load(path):
        time.sleep(0.3)
        return saved_model(path)

    monkeypatch.setattr(sensors, "SavedModel", load)
    os.mkfifo(path)
    end = os.open(path, os.O_RDWR)
    os.write(end, lines_of(sound("good", 2 * WINDOW, 3)))
    code, out, _ = run("watch", model, path, "--idle", 0.2)
    os.close(end)
    assert code == 0 and len(of_kind(out)["pipe"]) == 2


def test_a_state_without_facts_is_refused(run, model, tmp_path):
    state = tmp_path / "state.json"
    save_monitor_state(ConditionMonitor(SavedModel(model).diagnoser, RATE), state)
    code, _, err = run("watch", model, tmp_path, *IDLE, "--state", state)
    assert code == 1 and f"a state of None, expected {tmp_path}" in err
