"""Commands and programs of the pages on operation run as they are printed there."""

import glob
import itertools
import json
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import textwrap
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from skarxlag import make_detector, make_windows, save_diagnoser
from tests.plant.watch.watching import RATE, WINDOW, lines_of, sound

ROOT = Path(__file__).parents[3]
FENCED = re.compile(r"^```\w*\n(.*?)^```$", flags=re.S | re.M)
INDENTED = re.compile(r"(?:^ {4,}\S.*\n)+", flags=re.M)
#: How a block of each page begins, and the test that runs it.
TESTS = {
    "plant": {
        "skarxlag fit healthy.csv": "test_fit_and_check",
        "name,source,model": "test_service",
        "[Unit]": "test_service",
        "systemd-analyze": "test_unit",
        "skarxlag acknowledge": "test_acknowledge",
        "FROM": "test_image",
        "docker": "test_image",
        '"""Publish': "test_service",
        "skarxlag watch plant.csv": "test_mqtt, test_influx",
        '"""Convert': "test_influx",
        "skarxlag diagnose --bearing": "test_fit_and_check",
    },
    "monitoring": {
        ">>>": "test_docs.py",
        "arecord": "test_sound_card",
        '{"kind"': "test_example_of_a_line",
        "skarxlag acknowledge": "test_acknowledge",
        "name,source,model": "test_table",
        "skarxlag watch plant.csv": "test_table",
    },
}
needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
needs_parser = pytest.mark.skipif(
    find_spec("line_protocol_parser") is None, reason="no parser of line protocol"
)
pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


def blocks(page):
    """All blocks of code of a page, without their indent."""
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    indented = INDENTED.findall(FENCED.sub("", text))
    return [*FENCED.findall(text), *map(textwrap.dedent, indented)]


def block(page, start, holds=""):
    """The first block that begins so, and holds a text."""
    return next(
        text for text in blocks(page) if text.startswith(start) and holds in text
    )


@pytest.mark.parametrize("page", TESTS)
def test_every_block_has_its_test(page):
    found = blocks(page)
    unknown = [text for text in found if not text.startswith(tuple(TESTS[page]))]
    assert not unknown and len(found) >= len(TESTS[page])
    assert [
        start for start in TESTS[page] if not any(t.startswith(start) for t in found)
    ] == []


@pytest.fixture
def shell(tmp_path):
    """Run a script in a folder in which `skarxlag` and `python` are ours.

    `watch` ends when nothing has come for some seconds, and looks more often.
    """
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    ending = "--idle 0.8 --settle 0.05 --heartbeat 1e-3"
    programs = {
        "python": f'exec {sys.executable} "$@"',
        "skarxlag": f'[ "$1" = watch ] && set -- "$@" {ending}\n'
        f'exec {sys.executable} -m skarxlag "$@"',
    }
    for name, text in programs.items():
        (bin_ / name).write_text(f"#!/bin/sh\n{text}\n")
        (bin_ / name).chmod(0o755)
    path = os.pathsep.join([str(bin_), os.environ["PATH"]])
    python_path = os.pathsep.join([str(ROOT), *filter(None, sys.path)])
    environment = {**os.environ, "PATH": path, "PYTHONPATH": python_path}

    def run(script):
        command = ["bash", "-e", "-o", "pipefail", "-c", script]
        options = {"cwd": tmp_path, "env": environment, "timeout": 600}
        return subprocess.run(command, capture_output=True, text=True, **options)

    return run


def local(text, folder, port=1883):
    """Replace the places of a plant by a folder, and the broker by one of this machine."""
    places = {
        "/opt/skarxlag/bin": f"{folder}/bin",
        "/etc/skarxlag": str(folder),
        "%S/skarxlag": f"{folder}/states",
        "/var/lib/skarxlag": f"{folder}/states",
        "/data/": f"{folder}/data/",
        "mqtt://broker:1883": f"mqtt://127.0.0.1:{port}",
    }
    for place, other in places.items():
        text = text.replace(place, other)
    return text


def save_model(path, seed=2, rate=RATE):
    healthy = make_windows(sound("good", 100 * WINDOW, seed), WINDOW)
    detector = make_detector(fixed_gain=True).fit(healthy)
    facts = {"conditions": ["healthy"], "n_channels": 1, "train_rpm": [1480.0, 990.0]}
    save_diagnoser(detector, path, sampling_rate=rate, window_length=WINDOW, **facts)


@pytest.fixture
def plant(tmp_path):
    """The folder of the plant of the page: its table, models, files and programs."""
    (tmp_path / "plant.csv").write_text(
        local(block("plant", "name,source,model"), tmp_path)
    )
    for number, name in enumerate(["pump-7", "blower-2"]):
        save_model(tmp_path / f"{name}.skops")
        folder = tmp_path / "data" / name
        folder.mkdir(parents=True)
        for gain in (1, 50):
            path = folder / f"{gain}.npy"
            np.save(path, gain * sound("good", 30 * WINDOW, 3 + number))
            os.utime(path, (1.6e9 + gain, 1.6e9 + gain))
    (tmp_path / "publish.py").write_text(block("plant", '"""Publish'))
    (tmp_path / "influx.py").write_text(block("plant", '"""Convert'))
    return tmp_path


@pytest.fixture
def broker(tmp_path):
    """An MQTT broker on the loopback address, and the messages that it has passed on."""
    pytest.importorskip("amqtt", reason="no MQTT broker")
    mqtt = pytest.importorskip("paho.mqtt.client", reason="no MQTT client")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    anonymous = "amqtt.plugins.authentication.AnonymousAuthPlugin"
    settings = {
        "listeners": {"default": {"type": "tcp", "bind": f"127.0.0.1:{port}"}},
        "plugins": {anonymous: {"allow_anonymous": True}},
    }
    (tmp_path / "broker.yaml").write_text(json.dumps(settings))
    start = "import sys; from amqtt.scripts.broker_script import main; sys.exit(main())"
    command = [sys.executable, "-c", start, "-c", tmp_path / "broker.yaml"]
    with (tmp_path / "broker.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        for _ in range(300):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        messages = []
        client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        client.on_message = lambda client, data, message: messages.append(message)
        client.connect("127.0.0.1", port)
        client.subscribe("plant/#", qos=1)
        client.loop_start()
        yield port, messages
        client.disconnect()
        client.loop_stop()
    finally:
        process.terminate()
        process.wait(30)


@pytest.fixture
def run_lines(run, tmp_path, monkeypatch):
    """Run commands of a page in this process, in a folder; return what they print."""
    monkeypatch.chdir(tmp_path)

    def run_commands(script):
        printed = []
        for line in script.splitlines():
            program, *arguments = shlex.split(line)
            assert program == "skarxlag"
            paths = [sorted(glob.glob(text)) or [text] for text in arguments]
            code, out, err = run(*itertools.chain(*paths))
            assert code == 0, err
            printed.append(out + err)
        return printed

    return run_commands


def test_fit_and_check(run_lines, tmp_path):
    (tmp_path / "later").mkdir()
    for number, folder in enumerate([".", ".", "later"]):
        samples = (3000 * sound("good", 60_000, number)).astype(np.int16)
        wavfile.write(tmp_path / folder / f"{number}.wav", 12_000, samples)
    table = "path,rpm,condition\n0.wav,1480,healthy\n1.wav,1480,healthy\n"
    (tmp_path / "healthy.csv").write_text(table)
    fit, *of_later = run_lines(block("plant", "skarxlag fit healthy.csv"))
    assert "healthy" in fit and all("later/2.wav" in text for text in of_later)
    # The fit is repeated over its model.
    (again,) = (
        text
        for text in blocks("plant")
        if text.startswith("skarxlag fit") and text.count("\n") == 1
    )
    before = (tmp_path / "pump-7.skops").read_bytes()
    (tmp_path / "healthy.csv").write_text(table.rpartition("1.wav")[0])
    run_lines(again)
    assert (tmp_path / "pump-7.skops").read_bytes() != before
    assert "later/2.wav" in run_lines(block("plant", "skarxlag diagnose --bearing"))[0]


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd")
def test_unit(tmp_path):
    unit = tmp_path / "skarxlag.service"
    unit.write_text(block("plant", "[Unit]"))
    assert "systemd-analyze verify /etc/systemd/system/skarxlag.service" in block(
        "plant", "systemd-analyze"
    )
    checked = subprocess.run(
        ["systemd-analyze", "verify", unit], capture_output=True, text=True
    )
    assert (checked.returncode, checked.stderr) == (0, "")


def check_messages(messages, out):
    """One topic for each sensor and kind, and all lines arrived."""
    arrived = {}
    for message in messages:
        line = json.loads(message.payload)
        assert message.topic == f"plant/{line['sensor']}/{line['kind']}"
        arrived.setdefault(message.topic, []).append(line)
    topics = {f"plant/{name}/verdict" for name in ("pump-7", "blower 2")}
    assert topics <= arrived.keys() and "plant/pump-7/heartbeat" in arrived
    for topic in topics:
        assert [line["source"] for line in arrived[topic]] == ["1.npy", "50.npy"]
        assert arrived[topic][-1]["alarm"] is True


def waited(messages):
    """All messages, when no further one comes."""
    n_before = -1
    while n_before != len(messages):
        n_before = len(messages)
        time.sleep(0.5)
    return messages


@needs_bash
@pytest.mark.slow
def test_service(shell, plant, broker):
    """The command of the unit, whose verdicts go to a broker."""
    port, messages = broker
    command = re.search(
        r"^ExecStart=/bin/bash -o pipefail -c '(.*)'$", block("plant", "[Unit]"), re.M
    )
    found = shell(local(command[1], plant, port))
    assert found.returncode == 0, found.stderr
    check_messages(waited(messages), found.stdout)
    states = {path.name for path in (plant / "states").iterdir()}
    assert states == {"pump-7.json", "blower 2.json"}


@needs_parser
def test_influx(run, plant, monkeypatch):
    from line_protocol_parser import parse_line

    assert "| python influx.py" in block("plant", "skarxlag watch", "influx.py")
    with (plant / "plant.csv").open("a") as table:
        table.write("gone,data/gone,pump-7.skops,1480\n")
    monkeypatch.chdir(plant)
    ending = ("--idle", 0.3, "--settle", 0.02, "--heartbeat", 1e-3)
    code, out, err = run("watch", "plant.csv", *ending)
    # One sensor has a problem, which is the last field of its heartbeats.
    assert code == 1, err
    found = subprocess.run(
        [sys.executable, "influx.py"], input=out, capture_output=True, text=True
    )
    lines = [parse_line(text) for text in found.stdout.splitlines()]
    assert {line["tags"]["sensor"] for line in lines} == {"pump-7", "blower 2", "gone"}
    of_gone = [line["fields"] for line in lines if line["tags"]["sensor"] == "gone"]
    problems = {fields["problem"] for fields in of_gone}
    assert problems == {"data/gone: no such file or folder"}
    verdicts = [line for line in lines if line["tags"]["kind"] == "verdict"]
    assert {line["fields"]["alarm"] for line in verdicts} == {True, False}
    states = {line["fields"]["alarm_state"] for line in verdicts}
    assert states == {"off", "on"}
    times = {line["time"] for line in verdicts}
    assert times == {1_600_000_001_000, 1_600_000_050_000}


def test_acknowledge(run_lines, plant):
    """The alarm of the unit is latched until the commands of both pages acknowledge it."""
    ending = "--idle 0.3 --settle 0.02"
    watch = f"skarxlag watch plant.csv --latch --state {plant}/states {ending}"
    run_lines(watch)
    of_plant, of_monitoring = (block(page, "skarxlag acknowledge") for page in TESTS)
    run_lines(local(of_plant, plant))
    run_lines(of_monitoring.replace("FILE.json", f"'{plant}/states/blower 2.json'"))
    (printed,) = run_lines(watch)
    for name in ("pump-7", "blower 2"):
        assert f"{name}: The alarm was acknowledged, and is on." in printed


def test_sound_card(run_lines, piped, tmp_path):
    save_model(tmp_path / "bearing.skops", rate=48_000)
    piped((1000 * sound("good", 9 * WINDOW, 3)).astype("<i2").tobytes())
    source, command = block("monitoring", "arecord").splitlines()[0].split(" | ")
    assert source == "arecord -f S16_LE -r 48000 -t raw"
    (printed,) = run_lines(command)
    assert printed.count('"kind": "verdict"') == 9


def test_table(run_lines, tmp_path):
    (tmp_path / "plant.csv").write_text(
        local(block("monitoring", "name,source,model"), tmp_path)
    )
    for number, name in enumerate(["de", "fe"]):
        folder = tmp_path / "data" / "pump-7" / name
        folder.mkdir(parents=True)
        signals = np.stack([np.ones(5 * WINDOW), sound("good", 5 * WINDOW, number)])
        (folder / "1.csv").write_bytes(b"other,acc\n" + lines_of(signals))
    (tmp_path / "data" / "blower-2").mkdir()
    np.save(tmp_path / "data" / "blower-2" / "1.npy", sound("good", 5 * WINDOW, 3))
    for name in ("pump-7", "blower-2"):
        save_model(tmp_path / f"{name}.skops")
    command = local(block("monitoring", "skarxlag watch plant.csv"), tmp_path).strip()
    (printed,) = run_lines(f"{command} --idle 0.3 --settle 0.02")
    lines = [json.loads(line) for line in printed.splitlines() if line[0] == "{"]
    watched = [line["sensor"] for line in lines if line["kind"] == "verdict"]
    names = ["pump-7 drive end", "pump-7 fan end", "blower 2"]
    assert sorted(watched) == sorted(names)
    assert {path.stem for path in (tmp_path / "states").iterdir()} == {*names}


def builder():
    """A program that builds images and has the one that ours begins with, or why there is none."""
    image = re.match(r"FROM (\S+)", block("plant", "FROM"))[1]
    reason = "no builder of images"
    for name in filter(shutil.which, ["docker", "podman"]):
        for command in (["info"], ["pull", image]):
            done = subprocess.run(
                [name, *command], capture_output=True, text=True, timeout=300
            )
            if done.returncode != 0:
                reason = f"{name} {command[0]}: {done.stderr.strip()[-200:]}"
                break
        else:
            return name, ""
    return None, reason


@needs_bash
@pytest.mark.slow
def test_image(shell, plant):
    """The image is built, and watches the plant. Its name and its volume are those of the test."""
    name, reason = builder()
    if name is None:
        pytest.skip(reason)
    (plant / "Dockerfile").write_text(block("plant", "FROM"))
    (plant / "plant.csv").write_text(block("plant", "name,source,model"))
    # The user of the container is another one.
    plant.chmod(0o755)
    build, watch = block("plant", "docker build").splitlines()
    assert build == "docker build -t skarxlag ."
    places = {
        "docker run": f"{name} run",
        "-v /etc/skarxlag:": f"-v {plant}:",
        "-v /data:": f"-v {plant}/data:",
        "-v skarxlag:/state skarxlag": "-v /state skarxlag-test",
    }
    for place, other in places.items():
        assert watch.count(place) == 1
        watch = watch.replace(place, other)
    try:
        found = shell(f"{name} build -t skarxlag-test -f {plant}/Dockerfile {ROOT}")
        assert found.returncode == 0, found.stderr
        found = shell(f"{watch} --idle 3")
        assert found.returncode == 0, found.stderr
        lines = [json.loads(line) for line in found.stdout.splitlines()]
        assert {line["sensor"] for line in lines} == {"pump-7", "blower 2"}
    finally:
        subprocess.run([name, "rmi", "skarxlag-test"], capture_output=True)
