"""Public rigs, from a miniature that the writer of bearing-datasets makes."""

import sys

import numpy as np
import pytest

from skarxlag import bearing_orders
from skarxlag.datasets import load_public_rig, simulate_rig

from ..public_rigs import write_dataset

ORDERS = {"bpfo": 3.5848, "bpfi": 5.4152, "bsf": 2.3567, "ftf": 0.39828}
FAULTS = [("normal", "none"), ("inner", "0.007 in"), ("rolling_element", "0.014 in")]


def write(root, **columns):
    """Write a data set of three recordings with two channels, and return its samples."""
    samples = {}
    signals = []
    for number, (fault, severity) in enumerate(FAULTS):
        for channel in ("DE", "FE"):
            rng = np.random.default_rng(number)
            signal = rng.normal(size=250 + 100 * number).astype(np.float32)
            samples[f"run{number}/{channel}"] = signal
            facts = {
                "recording_id": f"run{number}",
                "channel": channel,
                "fs": 12_000,
                "fault_type": fault,
                "fault_severity": severity,
                "bearing_id": f"B{number}",
                "speed_rpm": 1797.0 - number,
                "load": 0.5,
                **ORDERS,
            }
            own = {
                key: value(number, channel) if callable(value) else value
                for key, value in columns.items()
            }
            stated = {
                key: value for key, value in (facts | own).items() if value == value
            }
            signals.append((stated, signal))
    write_dataset(root, "mini", signals)
    return samples


def test_windows_and_facts_of_the_chosen_channel(tmp_path):
    samples = write(tmp_path)
    rig = load_public_rig("mini", root=tmp_path, channel="FE", window_length=100)
    assert rig.recording.tolist() == 2 * ["run0"] + 3 * ["run1"] + 4 * ["run2"]
    assert rig.start.tolist() == [0, 100, 0, 100, 200, 0, 100, 200, 300]
    np.testing.assert_allclose(rig.data[3], samples["run1/FE"][100:200], rtol=1e-6)
    assert rig.target_names == ["healthy", "ball", "inner"]
    assert rig.target[[0, 2, 8]].tolist() == ["healthy", "inner", "ball"]
    assert rig.rpm[[0, 8]].tolist() == [1797, 1795]
    assert (rig.specimen[8], rig.load[8], rig.sampling_rate) == ("B2", 0.5, 12_000)
    assert bearing_orders(rig.bearing)["ball"] == pytest.approx(2 * 2.3567)
    assert rig.DESCR == "Mini\nNobody 2026\nLicence: CC0"


def test_the_condition_is_made_of_columns(tmp_path):
    write(tmp_path)
    rig = load_public_rig(
        "mini",
        root=tmp_path,
        channel="DE",
        condition=["fault_type", "fault_severity"],
        window_length=250,
    )
    assert rig.target.tolist() == ["healthy", "inner 0.007 in", "ball 0.014 in"]


def test_recordings_are_chosen_by_their_metadata(tmp_path):
    write(tmp_path)
    where = "channel == 'DE' and speed_rpm < 1797"
    rig = load_public_rig("mini", root=tmp_path, where=where, window_length=100)
    assert sorted(set(rig.recording)) == ["run1", "run2"]


@pytest.mark.parametrize(
    "load",
    [
        lambda root, **form: load_public_rig(
            "mini", root=root, channel="DE", window_length=100, **form
        ),
        lambda root, **form: simulate_rig(
            rpm=500, crack_mm=3, conditions="Normal", n_samples=2400, **form
        ),
    ],
    ids=["public", "simulated"],
)
def test_forms_of_a_rig(tmp_path, load):
    write(tmp_path)
    rig = load(tmp_path, as_frame=True)
    assert list(rig.frame) == ["rpm", "recording", "start", "specimen", "load"]
    assert rig.frame["recording"].tolist() == rig.recording.tolist()
    assert "frame" not in load(tmp_path)
    X, y = load(tmp_path, return_X_y=True)
    np.testing.assert_array_equal(X, rig.data)
    assert y.tolist() == rig.target.tolist()


def test_facts_that_are_not_stated(tmp_path):
    absent = dict.fromkeys(["load", "bearing_id", "bpfo"], np.nan)
    write(tmp_path, **absent)
    rig = load_public_rig("mini", root=tmp_path, channel="DE", window_length=100)
    assert np.isnan(rig.load).all() and rig.bearing is None
    assert rig.specimen.tolist() == rig.target.tolist()


def test_bearings_that_differ_have_no_common_orders(tmp_path):
    write(tmp_path, bpfo=lambda number, channel: 3.0 + number)
    rig = load_public_rig("mini", root=tmp_path, channel="DE", window_length=100)
    assert rig.bearing is None


@pytest.mark.parametrize(
    ("columns", "options", "message"),
    [
        ({}, {}, r"several channels: \['DE', 'FE'\]. Choose one by channel"),
        ({}, {"channel": "BA"}, r"channel == 'BA', expected one of \['DE', 'FE'\]"),
        ({}, {"where": "fs > 1e6"}, r"where == 'fs > 1e6', expected a condition that"),
        (
            {"fs": lambda number, channel: 12_000 * (1 + number)},
            {"channel": "DE"},
            r"several sampling rates: \[12000, 24000, 36000\] Hz. Choose one by where",
        ),
        (
            {},
            {"channel": "DE", "window_length": 300},
            r"Recordings shorter than window_length: \['run0'\], expected none",
        ),
        (
            {},
            {"channel": "DE", "condition": "size"},
            r"condition == \['size'\], expected",
        ),
        ({}, {"window_length": 0}, "window_length == 0"),
    ],
)
def test_bad_choices(tmp_path, columns, options, message):
    write(tmp_path, **columns)
    with pytest.raises(ValueError, match=message):
        load_public_rig("mini", root=tmp_path, **options)


def test_a_data_set_that_is_not_built(tmp_path):
    with pytest.raises(FileNotFoundError, match="bearing-datasets build cwru"):
        load_public_rig("cwru", root=tmp_path)


def test_without_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "bearing_datasets", None)
    with pytest.raises(ImportError, match=r"pip install 'skarxlag\[rigs\]'"):
        load_public_rig("cwru")
