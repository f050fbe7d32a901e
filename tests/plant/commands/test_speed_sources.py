"""Shaft speeds from a tachometer or a log, from the shell."""

import json

import numpy as np
import pytest

from skarxlag.datasets import simulate_rig


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    rig = simulate_rig(rpm=500, crack_mm=6, conditions=["OR"], n_samples=240_000)
    time = np.arange(240_000) / rig.sampling_rate
    pulses = np.sin(2 * np.pi * 4 * 500 / 60 * time) > 0.9
    path = tmp_path_factory.mktemp("runs") / "run.npz"
    emission = rig.data[:, 0].ravel()
    np.savez(path, emission=emission, tacho=pulses.astype(float), fs=rig.sampling_rate)
    return path


def diagnose(run, path, *options):
    output = path.with_name("results.json")
    options = ("--bearing", "6205", "--channel", "emission", "-o", output, *options)
    code, _, err = run("diagnose", path, *options)
    if code != 0:
        return code, err
    rows = json.loads(output.read_text())["recordings"]
    keys = ("verdict", "remark", "probability", "p_value")
    return code, [[row[key] for key in keys] for row in rows]


def test_a_tacho_channel_and_a_log_give_the_verdict_of_the_stated_speed(run, path):
    stated = diagnose(run, path, "--rpm", 500)
    log = path.with_name("speeds.csv")
    log.write_text("recording,rpm\nrun,500\n")
    assert diagnose(run, path, "--rpm", log) == stated
    pulsed = diagnose(run, path, "--rpm", "tacho:tacho", "--pulses-per-revolution", 4)
    assert pulsed[0] == 0 and pulsed[1][0][0] == stated[1][0][0]
    slow = diagnose(run, path, "--rpm", "tacho:tacho", "--pulses-per-revolution", 5)
    assert slow[1] != pulsed[1]
