"""Dates without a zone are in UTC, whatever the zone of the machine and its hour of summer."""

import time

import numpy as np
import pandas as pd
import pytest

from skarxlag import read_recording
from skarxlag.plant.readers.files import recording_start
from skarxlag.plant.watch.lines import iso_date

pytestmark = pytest.mark.skipif(not hasattr(time, "tzset"), reason="Windows has no TZ")
#: Zones as POSIX has them, so that no database of zones is needed.
ZONES = [
    "UTC0",
    "CET-1CEST,M3.5.0,M10.5.0/3",
    "NST3:30NDT,M3.2.0,M11.1.0",
    "NZST-12NZDT,M9.5.0,M4.1.0/3",
]


@pytest.fixture(params=ZONES)
def zone(request, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setenv("TZ", request.param)
        time.tzset()
        yield request.param
    time.tzset()


# The hours in which clocks are turned, in one of these zones.
@pytest.mark.parametrize(
    ("day", "suffix"),
    [
        *(("2026-10-25", "csv"), ("2026-10-25", "parquet"), ("2026-03-29", "csv")),
        *(("2026-11-01", "csv"), ("2026-04-05", "csv")),
    ],
)
def test_recordings_over_the_turn_of_clocks(tmp_path, zone, day, suffix):
    path = tmp_path / f"run.{suffix}"
    dates = pd.date_range(f"{day}T00:30", periods=3000, freq="4s")
    frame = pd.DataFrame({"time": dates, "y": np.arange(3000.0)})
    if suffix == "csv":
        frame.assign(time=dates.strftime("%d.%m.%Y %H:%M:%S")).to_csv(path, index=False)
    else:
        frame.to_parquet(path)
    signal, rate = read_recording(path)
    np.testing.assert_array_equal(signal, frame["y"])
    assert rate == 0.25
    since = dates[0] - pd.Timestamp("1970-01-01")
    assert recording_start(path) == since.total_seconds()


def test_times_of_verdicts_are_in_utc(zone):
    assert iso_date(1_792_893_600.5) == "2026-10-25T02:00:00.500+00:00"
