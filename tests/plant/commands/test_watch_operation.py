"""Sensors that fail, are mended and get other models while ``watch`` runs."""

import contextlib
import io
import itertools
import json
import os
import shutil
import signal
import sys
import threading
import time

import numpy as np
import pandas as pd
import pytest

from skarxlag import (
    load_monitor_state,
    make_detector,
    make_diagnoser,
    make_windows,
    save_diagnoser,
)
from skarxlag.plant.commands import main
from tests.plant.commands.watching import IDLE, RATE, WINDOW, lines_of, sound

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")
#: Each pass of the command looks for what has changed.
LOOK = ("--retry", 1e-9, "--settle", 0.01)


@pytest.fixture(scope="module")
def saved_models(fitted, tmp_path_factory):
    """Two files of the same diagnoser with other healthy limits, which take the level, too."""
    folder = tmp_path_factory.mktemp("models")
    for number in range(2):
        healthy = make_windows(sound("good", 100 * WINDOW, 2 + number), WINDOW)
        save_diagnoser(
            fitted[0],
            folder / f"{number}.skops",
            window_length=WINDOW,
            sampling_rate=RATE,
            conditions=["good", "worn"],
            n_channels=1,
            detector=make_detector(fixed_gain=True).fit(healthy),
        )
    return folder


@pytest.fixture
def two_models(saved_models, tmp_path):
    """Copies of the models for one test."""
    shutil.copytree(saved_models, tmp_path, dirs_exist_ok=True)
    return [tmp_path / "0.skops", tmp_path / "1.skops"]


@pytest.fixture
def plant(two_models, tmp_path):
    """Write a table of three logs, and return its path."""
    for number in range(3):
        log = lines_of(sound("good", 3 * WINDOW, 10 + number))
        (tmp_path / f"{number}.csv").write_bytes(log)
    columns = {"name": ["a", "b", "c"], "source": ["0.csv", "1.csv", "2.csv"]}
    path = tmp_path / "plant.csv"
    pd.DataFrame(columns | {"model": "0.skops", "rpm": 900}).to_csv(path, index=False)
    return path


@pytest.fixture
def during(monkeypatch):
    """Set what happens in the pauses of the command, in turn. A signal ends it afterwards."""

    def play(*actions):
        waiting, pause = [*actions, *[lambda: None] * 20], time.sleep

        def sleep(seconds):
            pause(0.002)
            if waiting:
                waiting.pop(0)()
            else:
                signal.raise_signal(signal.SIGINT)

        monkeypatch.setattr(time, "sleep", sleep)

    return play


def of_kind(out, kind="verdict"):
    """Lines of a kind, by sensor."""
    lines = [json.loads(line) for line in out.splitlines()]
    of_sensors = {}
    for line in lines:
        if line["kind"] == kind:
            of_sensors.setdefault(line["sensor"], []).append(line)
    return of_sensors


def n_verdicts(out):
    """Number of verdicts, by sensor."""
    return {name: len(lines) for name, lines in of_kind(out).items()}


def change(path, **columns):
    table = pd.read_csv(path).astype(object).assign(**columns)
    table.to_csv(path, index=False)


def exchange(new, old):
    """Move a copy of a model to the place of another, as `fit -o` does."""
    copy = old.with_suffix(".new")
    copy.write_bytes(new.read_bytes())
    os.replace(copy, old)


@pytest.mark.parametrize(
    ("column", "cell", "message"),
    [
        ("source", "gone", "gone: no such file or folder"),
        ("source", "-", "line 3: source '-', expected a file or a folder"),
        ("rpm", "fast", "line 3: rpm is 'fast', expected a positive number"),
        ("model", "gone.skops", "gone.skops: no such file"),
        ("model", "0.csv", "0.csv: no diagnoser saved by skarxlag"),
        ("model", "", "line 3: the model is empty, expected a file"),
        ("name", "b/c", "line 3: name 'b/c', expected a unique name"),
        ("name", "", "line 3: name '', expected a unique name"),
    ],
)
def test_a_sensor_that_cannot_be_watched_does_not_keep_the_others_from_it(
    run, plant, column, cell, message
):
    cells = pd.read_csv(plant)[column].tolist()
    change(plant, **{column: [cells[0], cell, cells[2]]})
    code, out, err = run("watch", plant, *IDLE, *LOOK, "--heartbeat", 0.01)
    assert code == 1 and "Traceback" not in err
    assert n_verdicts(out) == {"a": 3, "c": 3}
    # It is tried again in each pass, and reported once.
    (line,) = (line for line in err.splitlines() if "error" in line)
    assert message in line and "tried again every 1e-09 s" in line
    beats = of_kind(out, "heartbeat")
    (failed,) = beats.keys() - {"a", "c"}
    assert {beat["problem"] is None for beat in beats.get("a", [])} <= {True}
    for beat in beats[failed]:
        assert message in beat["problem"] and line.startswith(f"{failed}: error: ")
        assert beat["verdict"] is beat["alarm"] is beat["healthy"] is None


@pytest.mark.parametrize("content", [b"damaged", b'{"format": "skarxlag monitor 1"}'])
def test_a_state_that_cannot_be_read_concerns_its_sensor(run, plant, content):
    states = plant.parent / "states"
    states.mkdir()
    (states / "b.json").write_bytes(content)
    code, out, err = run("watch", plant, *IDLE, *LOOK, "--state", states)
    assert code == 1 and of_kind(out).keys() == {"a", "c"}
    assert err.count("b: error: ") == 1 and "b.json: no state of a monitor" in err
    assert (states / "b.json").read_bytes() == content


def test_a_sensor_is_not_tried_again_too_soon(run, plant, during):
    change(plant, source=["0.csv", "later.csv", "2.csv"])
    log = lines_of(sound("good", WINDOW, 5))
    during(lambda: (plant.parent / "later.csv").write_bytes(log))
    code, out, err = run("watch", plant)
    assert code == 1
    assert of_kind(out).keys() == {"a", "c"}
    assert "tried again every 60 s" in err


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"b,1.csv,0.skops", "line 3: 3 fields, expected 4"),
        (b"b,1.csv,0.skops,900,", "line 3: 5 fields, expected 4"),
        (b'"b,1.csv,0.skops,900', "line 3: 1 field, expected 4"),
        (b"b," + bytes(200_000) + b",0.skops,900", "line 3: 0 fields, expected 4"),
        (b"b,caf\xe9.csv,0.skops,900", "caf\\xe9.csv: no such file or folder"),
    ],
    ids=["few", "many", "quote", "long", "latin"],
)
def test_a_line_that_cannot_be_parsed_spoils_no_other(run, plant, line, message):
    lines = plant.read_bytes().splitlines()
    lines[2] = line
    plant.write_bytes(b"\r\n".join(lines))
    code, out, err = run("watch", plant, *IDLE)
    assert code == 1 and of_kind(out).keys() == {"a", "c"} and "Traceback" not in err
    (error,) = (each for each in err.splitlines() if "error" in each)
    assert message in error.replace("\\\\", "\\")
    # Empty lines count.
    plant.write_bytes(b"\n\n".join(lines))
    assert message.replace("line 3", "line 5") in run("watch", plant, *IDLE)[2].replace(
        "\\\\", "\\"
    )


def test_lines_of_equal_names_are_both_refused(run, plant):
    change(plant, name=["a", "b", "a"])
    code, out, err = run("watch", plant, *IDLE)
    assert code == 1 and of_kind(out).keys() == {"b"}
    assert "line 2: name 'a', expected a unique name" in err
    assert "line 4: name 'a', expected a unique name" in err


def test_a_source_that_comes_later_is_watched_from_then_on(run, plant, during):
    change(plant, source=["0.csv", "logger", "2.csv"])

    def arrive():
        (plant.parent / "logger").mkdir()
        np.save(plant.parent / "logger" / "a.npy", sound("good", 3 * WINDOW, 5))

    during(lambda: None, lambda: None, arrive)
    code, out, err = run("watch", plant, *LOOK)
    assert code == 0 and [line["start"] for line in of_kind(out)["b"]] == [0, 200, 400]
    assert err.count("b: error: ") == err.count("b: watched again") == 1


def test_a_source_that_fails_while_it_is_watched_is_tried_again(run, plant, during):
    folder = plant.parent / "logger"
    folder.mkdir()
    change(plant, source=["0.csv", "logger", "2.csv"])
    np.save(folder / "a.npy", sound("good", 3 * WINDOW, 5))

    def leave():
        (folder / "a.npy").unlink()
        folder.rmdir()

    def come_back():
        folder.mkdir()
        np.save(folder / "b.npy", sound("good", 2 * WINDOW, 6))

    nothing = [lambda: time.perf_counter()] * 12
    during(*nothing, leave, *nothing, come_back, *nothing)
    code, out, err = run("watch", plant, *LOOK)
    found = of_kind(out)
    assert code == 0 and {line["source"] for line in found["b"]} == {"a.npy", "b.npy"}
    # The monitor continues where it was.
    assert [line["start"] for line in found["b"]] == [0, 200, 400, 600, 800]
    assert len(found["a"]) == len(found["c"]) == 3
    errors = [line for line in err.splitlines() if line.startswith("b: error: ")]
    assert len(errors) == len({*errors}) and err.count("b: watched again") == 1


def test_lines_of_the_table_are_corrected_added_changed_and_removed(run, plant, during):
    change(plant, rpm=[900, "fast", 900])
    corrected = pd.read_csv(plant).assign(rpm=[900, 901, 900])
    added = dict.fromkeys(corrected) | {"name": "d", "source": "0.csv"}
    added |= {"model": "0.skops", "rpm": 902}
    grown = pd.concat([corrected, pd.DataFrame([added])])
    others = grown[grown["name"] != "c"].replace({902: 903})
    during(
        lambda: corrected.to_csv(plant, index=False),
        lambda: grown.to_csv(plant, index=False),
        lambda: plant.write_text("what\n"),
        lambda: None,
        lambda: others.to_csv(plant, index=False),
    )
    code, out, err = run("watch", plant, *LOOK)
    assert code == 0
    speeds = {
        name: [line["rpm"] for line in lines] for name, lines in of_kind(out).items()
    }
    # Without a state, a sensor that is started again reads its source from the
    # beginning.
    assert speeds == {
        "a": [900] * 3,
        "b": [901] * 3,
        "c": [900] * 3,
        "d": [902] * 3 + [903] * 3,
    }
    refused = "plant.csv: 0 sensors with the columns what; expected name, source"
    assert err.count(refused) == 1 and "the sensors are watched as before" in err
    ended = [line for line in err.splitlines() if "600 samples" in line]
    assert [line.split(":")[0] for line in ended] == ["c", "d", "a", "b", "d"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_a_pipe_is_not_opened_again_if_its_line_changes(run, plant, during):
    os.mkfifo(plant.parent / "pipe")
    change(plant, source=["0.csv", "pipe", "2.csv"])
    pipe = os.open(plant.parent / "pipe", os.O_RDWR)
    os.write(pipe, lines_of(sound("good", WINDOW, 5)))

    def append():
        os.write(pipe, lines_of(sound("good", WINDOW, 6)))

    during(lambda: None, lambda: change(plant, rpm=901), append)
    code, out, err = run("watch", plant, *LOOK)
    os.close(pipe)
    assert code == 0
    assert [(v["start"], v["rpm"]) for v in of_kind(out)["b"]] == [(0, 900), (200, 900)]
    refused = "b: a pipe or a device cannot be opened again; its line was not read"
    assert err.count(refused) == 1
    assert [v["rpm"] for v in of_kind(out)["a"]] == [900] * 3 + [901] * 3


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_a_pipe_of_other_channels_is_tried_again_without_a_thread_for_each_attempt(
    run, plant, during
):
    os.mkfifo(plant.parent / "pipe")
    change(plant, source=["0.csv", "pipe", "2.csv"])
    pipe = os.open(plant.parent / "pipe", os.O_RDWR | os.O_NONBLOCK)
    pieces = []
    n_before = threading.active_count()

    def append():
        with contextlib.suppress(BlockingIOError):
            pieces.append(os.write(pipe, b"1.0,2.0\n" * 200))

    during(*[append] * 8)
    code, _, err = run("watch", plant, *LOOK)
    assert code == 1 and err.count("b: error: ") == 1
    assert "2 channels, expected 1" in err
    for _ in range(300):
        # Those that wait for the pipe end with what it holds next.
        append()
        if threading.active_count() <= n_before + 1 and len(pieces) > 8:
            break
        threading.Event().wait(0.01)
    else:
        pytest.fail("threads remain")
    os.close(pipe)


def test_a_table_that_stays_damaged_is_a_problem(run, plant, during):
    during(lambda: plant.write_text("what\n"), *[lambda: None] * 5)
    code, out, err = run("watch", plant, *LOOK)
    assert code == 1 and err.count("the sensors are watched as before") == 1
    assert n_verdicts(out) == {"a": 3, "b": 3, "c": 3}


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device")
def test_an_output_that_is_full_ends_the_command(run, plant, monkeypatch):
    # The file tries to write what it holds once more when it is closed.
    with pytest.raises(OSError, match="28"), open("/dev/full", "w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        code, _, err = run("watch", plant, "--idle", 1)
    assert code == 1 and "standard output: [Errno 28]" in err
    assert "Traceback" not in err and "tried again" not in err


@pytest.mark.parametrize("is_running", [True, False])
def test_the_model_of_one_sensor_is_exchanged(
    run, plant, two_models, during, is_running
):
    """The others keep theirs, no sample is read twice, and states name their model."""
    table, log = plant, plant.parent / "1.csv"
    private = table.parent / "b.skops"
    private.write_bytes(two_models[0].read_bytes())
    change(table, model=["0.skops", "b.skops", "0.skops"])
    options = ("watch", table, *LOOK, "--state", table.parent / "states")
    appended = lines_of(sound("good", 2 * WINDOW, 20))

    def append():
        with log.open("ab") as file:
            file.write(appended)

    if is_running:
        during(lambda: exchange(two_models[1], private), lambda: None, append)
        code, out, err = run(*options)
    else:
        during()
        before = run(*options)[1]
        exchange(two_models[1], private)
        append()
        during()
        code, out, err = run(*options)
        out = before + out
    found = of_kind(out)
    assert code == 0 and "Traceback" not in err and "error" not in err
    old, new = (line["model"] for line in (found["b"][0], found["b"][-1]))
    models = [(line["start"], line["model"]) for line in found["b"]]
    assert models == [(0, old), (200, old), (400, old), (0, new), (200, new)]
    assert {line["model"] for line in found["a"] + found["c"]} == {old} != {new}
    assert f"b: The state is of model {old} ({private}), not of {new} (" in err
    state, facts = load_monitor_state(table.parent / "states" / "b.json")
    assert facts["model"].startswith(new) and facts["model_file"] == str(private)
    assert state["stream"]["n_samples"] == 2 * WINDOW
    exchanged = f"b: Before the exchange of the model: {3 * WINDOW} samples"
    assert (exchanged in err) == is_running
    code, out, _ = run("info", private)
    assert code == 0 and f"model                 {new}" in out


def test_a_model_that_cannot_be_read_does_not_replace_the_present_one(
    run, plant, during
):
    private, log = plant.parent / "0.skops", plant.parent / "0.csv"
    whole, model = private.read_bytes(), plant.parent / "1.skops"
    change(plant, model=["0.skops", "1.skops", "1.skops"])

    def append():
        with log.open("ab") as file:
            file.write(lines_of(sound("good", WINDOW, 20)))

    during(
        lambda: private.write_bytes(whole[:1000]),
        append,
        lambda: exchange(model, private),
    )
    code, out, err = run("watch", plant, *LOOK)
    found = of_kind(out)["a"]
    assert code == 0 and [line["start"] for line in found] == [0, 200, 400, 600]
    assert len({line["model"] for line in found}) == 1
    (line,) = (line for line in err.splitlines() if "error" in line)
    assert "a: error: " in line and "0.skops: no diagnoser saved by skarxlag" in line
    assert "; the model before is used" in line and "a: watched again" in err


def test_an_alarm_is_latched_until_it_is_acknowledged(run, plant, two_models):
    log, states = plant.parent / "0.csv", plant.parent / "states"
    options = ("watch", plant, *IDLE, "--latch", "--alarm-delay", 3, "--state", states)

    def watched(signal, *further):
        with log.open("ab") as file:
            file.write(lines_of(signal))
        code, out, _ = run(*options, *further)
        assert code == 0
        return [
            (line["exceeds"], line["alarm"], line["alarm_state"])
            for line in of_kind(out)["a"]
        ]

    loud, calm = 50 * sound("good", 4 * WINDOW, 30), sound("good", 20 * WINDOW, 31)
    *_, before, third, fourth = watched(loud)
    assert before == (True, False, "not yet an alarm")
    assert third == fourth == (True, True, "on")
    assert watched(calm)[-1] == (False, True, "latched")
    # A new model does not acknowledge it, either.
    exchange(two_models[1], two_models[0])
    assert watched(calm) == [(False, True, "latched")] * 20
    code, out, err = run("acknowledge", states / "b.json")
    assert code == 1 and "b.json: there is no latched alarm" in err
    code, out, err = run("acknowledge", states / "a.json")
    assert code == 0 and out == "" and "a.json: the alarm will be acknowledged" in err
    assert watched(calm) == [(False, False, "off")] * 20
    assert not [path.name for path in states.iterdir() if path.suffix != ".json"]
    code, _, err = run("acknowledge", states / "a.json")
    assert code == 1 and "there is no latched alarm" in err
    code, _, err = run("acknowledge", states / "gone.json")
    assert code == 1 and "gone.json: no such file" in err


def test_an_alarm_is_acknowledged_while_it_is_watched(run, plant, during):
    log, state = plant.parent / "0.csv", plant.parent / "states" / "a.json"
    with log.open("ab") as file:
        file.write(lines_of(50 * sound("good", 4 * WINDOW, 30)))
    with log.open("ab") as file:
        file.write(lines_of(sound("good", 30 * WINDOW, 31)))
    codes = []
    during(lambda: None, lambda: codes.append(run("acknowledge", state)[0]))
    options = ("--latch", "--alarm-delay", 3, "--every", 1e6, "--heartbeat", 0.001)
    code, out, err = run("watch", plant, *LOOK, *options, "--state", state.parent)
    # The command within the pause has taken the lines that were written before.
    assert codes == [0] and code == 0
    assert err.count("a: The alarm was acknowledged, and is off.") == 1
    (line,) = of_kind(out, "acknowledged")["a"]
    assert line["alarm"] is False
    assert line["alarm_state"] == "off"
    assert line["verdict"] == "good"
    later = of_kind(out, "heartbeat")["a"][-1]
    assert later["alarm"] is False and later["alarm_state"] == "off"


def test_a_sensor_has_the_name_of_its_folder(run, two_models, tmp_path, monkeypatch):
    (tmp_path / "pump").mkdir()
    np.save(tmp_path / "pump" / "1.npy", sound("good", WINDOW, 3))
    monkeypatch.chdir(tmp_path / "pump")
    _, out, _ = run("watch", two_models[0], ".", *IDLE)
    assert of_kind(out).keys() == {"pump"}


@pytest.mark.parametrize("delay", [1, 5])
def test_the_delay_of_the_alarm_is_chosen_and_printed(run, two_models, piped, delay):
    piped(lines_of(50 * sound("good", 8 * WINDOW, 30)))
    code, out, err = run("watch", two_models[0], "-", "--alarm-delay", delay)
    (found,) = of_kind(out).values()
    assert code == 0 and [line["alarm"] for line in found].index(True) == delay - 1
    seconds = f"({0.2 * delay:g} s of signal, plus its pauses)"
    windows = {
        1: "1 window in a row that exceeds",
        5: "5 windows in a row that exceed",
    }[delay]
    assert f"Alarm: after {windows} the healthy limits {seconds}" in err


def test_the_delay_follows_from_the_interval_of_false_alarms(run, two_models, piped):
    delays = {}
    for hours in (1, 1000):
        piped(lines_of(50 * sound("good", 40 * WINDOW, 30)))
        _, out, err = run("watch", two_models[0], "-", "--false-alarm-interval", hours)
        (found,) = of_kind(out).values()
        delays[hours] = [line["alarm"] for line in found].index(True) + 1
        assert f"Alarm: after {delays[hours]} windows in a row" in err
        stated = err.split("Mean time between false alarms: ")[1].split()[0]
        assert float(stated) >= hours
    assert 1 < delays[1] < delays[1000]
    options = ("--alarm-delay", 3, "--false-alarm-interval", 9)
    code, _, err = run("watch", two_models[0], "-", *options)
    assert code == 2 and "not allowed with argument" in err


def test_no_line_shows_a_window_above_the_limits_without_the_state_of_the_alarm(
    run, two_models, piped
):
    signal = np.concatenate([sound("good", 2000, 3), 50 * sound("good", 8000, 4)])
    piped(lines_of(signal))
    (found,) = of_kind(run("watch", two_models[0], "-")[1]).values()
    states = {
        line["alarm_state"] for line in found if line["exceeds"] and not line["alarm"]
    }
    assert states == {"not yet an alarm"}
    assert {line["alarm_state"] for line in found if line["alarm"]} == {"on"}


def test_a_status_line_says_that_there_is_not_yet_an_alarm(
    run, two_models, piped, monkeypatch
):
    ticks = itertools.count()
    monkeypatch.setattr(time, "monotonic", lambda: next(ticks))
    piped(lines_of(50 * sound("good", 450, 3)))
    _, out, err = run("watch", two_models[0], "-", "-v")
    ((*_, last),) = of_kind(out).values()
    status = "0.4 s, possibly changed, not yet an alarm, at "
    assert last["probability"] is None
    assert err.splitlines()[2].startswith(status)


def test_the_model_of_a_stream_is_exchanged_while_the_stream_stays_open(
    two_models, fitted, inputs, monkeypatch
):
    """Samples that a pipe held before are not lost, and later ones have their verdict."""
    model, other = two_models
    X = np.zeros((4, 2, WINDOW))
    X[:, 0] = sound("good", 4 * WINDOW, 5).reshape(4, WINDOW)
    of_two = make_diagnoser().fit(X + X[:, ::-1], [0, 1] * 2)
    facts = {"conditions": ["good", "worn"], "window_length": WINDOW, "n_channels": 1}
    reading, writing = os.pipe()
    inputs.append(os.fdopen(reading))
    monkeypatch.setattr(sys, "stdin", inputs[-1])
    out = io.StringIO()
    err = io.StringIO()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)

    def wait_for(stream, text, count=1):
        while stream.getvalue().count(text) < count:
            assert time.monotonic() < end
            time.sleep(0.002)

    def play():
        with os.fdopen(writing, "wb", buffering=0) as pipe:
            pipe.write(lines_of(sound("good", WINDOW, 3)))
            wait_for(out, "\n")
            save_diagnoser(of_two, model, sampling_rate=RATE, n_channels=2)
            wait_for(err, "2 channels, expected 1; the model before is used")
            pipe.write(lines_of(sound("good", WINDOW, 4)))
            wait_for(out, "\n", 2)
            save_diagnoser(fitted[0], model, sampling_rate=1.5 * RATE, **facts)
            wait_for(err, "sampled at 1500 Hz, expected 1000 Hz")
            exchange(other, model)
            wait_for(err, "Before the exchange of the model: 400 samples")
            pipe.write(lines_of(sound("good", WINDOW, 5)))

    end = time.monotonic() + 60
    player = threading.Thread(target=play)
    player.start()
    assert main(["watch", str(model), "-", "--retry", "0.01"]) == 0
    player.join()
    first, again, last = map(json.loads, out.getvalue().splitlines())
    assert [first["start"], again["start"], last["start"]] == [0, 200, 0]
    assert first["model"] == again["model"] != last["model"]
