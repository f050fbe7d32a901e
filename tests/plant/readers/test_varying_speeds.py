"""Shaft speeds that vary within a recording."""

import numpy as np
import pandas as pd
import pytest

from skarxlag import load_recordings, read_recording_table
from skarxlag.plant.readers.cutting import (
    cut_recordings,
    speeds_within_rows,
)
from skarxlag.plant.readers.listing import list_recordings
from skarxlag.plant.readers.speeds import SpeedProfile

RATE, SECONDS = 5000, 4
TIME = np.arange(RATE * SECONDS) / RATE
SPEED = 600 + 150 * TIME
KEY = np.sin(2 * np.pi * np.cumsum(SPEED / 60) / RATE) > 0.9
Y = np.random.default_rng(0).normal(size=len(TIME))


def table(folder, rpm):
    (folder / "table.csv").write_text(
        f"path,condition,channel,rpm\nrun.npz,a,y,{rpm}\n"
    )
    return folder / "table.csv"


def write(folder, source):
    content = {"y": Y, "fs": RATE}
    if source == "tacho":
        content["key"] = KEY.astype(float)
    elif source == "channel":
        content["rpm"] = SPEED
    elif source == "slow channel":
        content["rpm"] = SPEED[:: RATE // 100]
    else:
        seconds = np.linspace(-1, SECONDS + 1, 60)
        pd.DataFrame({"time": seconds, "rpm": 600 + 150 * seconds}).to_csv(
            folder / "log.csv", index=False
        )
    np.savez(folder / "run.npz", **content)
    rpm = {"tacho": "tacho:key", "log": "log.csv"}.get(source)
    return folder / "*.npz" if rpm is None else table(folder, rpm)


@pytest.mark.parametrize("source", ["tacho", "channel", "slow channel", "log"])
def test_windows_have_the_speed_of_their_own_time(tmp_path, source):
    path = write(tmp_path, source)
    channel = "y" if source.endswith("channel") else None
    rig = load_recordings(path, window_length=1000, channel=channel)
    expected = SPEED.reshape(-1, 1000).mean(axis=1)
    inner = slice(1, -1) if source in ("tacho", "log") else slice(None)
    np.testing.assert_allclose(rig.rpm[inner], expected[inner], rtol=5e-3)
    np.testing.assert_allclose(
        read_recording_table(path, channel=channel).rpm, SPEED.mean(), rtol=5e-3
    )


def test_a_channel_of_unknown_rate_has_a_mean(tmp_path):
    np.savez(tmp_path / "run.npz", y=Y, rpm=SPEED)
    (entry,) = list_recordings(tmp_path / "*.npz", channel="y")
    entry = entry.with_speed()
    assert entry.profile is None and entry.rpm == pytest.approx(SPEED.mean())
    (stated,) = list_recordings(tmp_path / "*.npz", channel="y", sampling_rate=RATE)
    assert stated.with_speed().profile is not None


def test_rows_that_cannot_be_used(tmp_path):
    """From rest, the first row varies by more than a factor of 5, and a slow one has few turns."""
    speed = 300 * TIME
    np.savez(tmp_path / "run.npz", y=Y, rpm=speed, fs=RATE)
    listed = list_recordings(tmp_path / "*.npz", channel="y")
    rig = cut_recordings(listed, tmp_path, 2500)
    rpm, errors = speeds_within_rows(rig)
    np.testing.assert_allclose(rpm[1:], speed.reshape(-1, 2500)[1:], rtol=0.02)
    assert errors[0].startswith("speed varies from 1.47 to") and not errors[1:].any()
    assert errors[0].endswith("rpm within the row")
    _, errors = speeds_within_rows(rig, least_revolutions=3)
    assert errors[1] == "the row has less than 3 revolutions" and not errors[2:].any()


def test_a_steady_speed_is_one_number_for_each_row(tmp_path):
    np.savez(tmp_path / "run.npz", y=Y, rpm=900 + 0 * TIME, fs=RATE)
    rig = cut_recordings(
        list_recordings(tmp_path / "*.npz", channel="y"), tmp_path, 2500
    )
    assert speeds_within_rows(rig)[0].tolist() == [900.0] * 8


def test_a_log_with_a_stop(tmp_path):
    np.savez(tmp_path / "run.npz", y=Y, fs=RATE)
    (tmp_path / "log.csv").write_text("time,rpm\n3,900\n1,0\n0,0\n")
    (entry,) = list_recordings(table(tmp_path, "log.csv"))
    profile = entry.with_speed().profile
    assert profile.seconds.tolist() == [0, 1, 3] and profile.rpm.tolist() == [0, 0, 900]
    (tmp_path / "log.csv").write_text("time,rpm\n0,0\n1,0\n")
    with pytest.raises(ValueError, match="states no speed above 0"):
        entry.with_speed()


def test_the_mean_of_a_profile_is_over_time():
    profile = SpeedProfile(
        np.array([0.0, 0.1, 0.2, 2.0]), np.array([0.0, 0.0, 0.0, 900.0])
    )
    assert profile.mean() == pytest.approx(900 * 0.9 / 2, rel=1e-3)
