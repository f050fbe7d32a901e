"""The simulated rig as a data set: layout, reproducibility, errors."""

from collections import Counter

import numpy as np
import pytest
from sklearn.utils import Bunch

from skarxlag.datasets.rig import Rig
from skarxlag.datasets.simulated import simulate_rig

TABLE_1 = ["Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
SMALL = {"rpm": 500, "crack_mm": 3, "n_samples": 6000}


@pytest.fixture(scope="module")
def default_rig():
    """All recordings, shorter than the default."""
    return simulate_rig(n_samples=24_000)


def select(rig, **columns):
    rows = np.ones(len(rig.target), dtype=bool)
    for name, value in columns.items():
        rows &= rig[name] == value
    return rig.data[rows]


def test_default_is_table_1(default_rig):
    assert simulate_rig(conditions="Normal", rpm=500).data.shape == (100, 2, 1200)
    rig = default_rig
    # Four normal recordings, and seven faults at four speeds with two cracks, 20
    # windows each.
    assert isinstance(rig, Bunch) and rig.data.shape == (20 * (4 + 7 * 4 * 2), 2, 1200)
    assert rig.data.dtype == np.float64
    assert rig.target_names == TABLE_1
    assert rig.sampling_rate == 250e3
    kinds = [(rpm, "Normal", 0) for rpm in (300, 400, 450, 500)]
    kinds += [(r, c, w) for r, *_ in kinds for c in TABLE_1[1:] for w in (3, 6)]
    rows = zip(rig.rpm, rig.target, rig.crack_mm, strict=True)
    assert Counter(rows) == dict.fromkeys(kinds, 20)
    starts = rig.start.reshape(60, 20)
    np.testing.assert_array_equal(starts, np.tile(np.arange(0, 24_000, 1200), (60, 1)))
    recordings = rig.recording.reshape(60, 20)
    assert np.all(recordings == recordings[:, :1])
    assert rig.recording[0] == "Normal_300rpm"
    assert rig.recording[-1] == "IR-OR-Ball_500rpm_6mm"
    for text in ("Simulated rig, not a measurement", "of F. Piltan", "BSD-3"):
        assert text in rig.DESCR
    some = simulate_rig(**SMALL, conditions=("OR", "Normal"))
    assert some.target_names == ["Normal", "OR"]
    assert some.target[[0, -1]].tolist() == ["Normal", "OR"]


def test_window_length_only_cuts():
    coarse, fine = (
        simulate_rig(**SMALL, conditions="IR", window_length=length)
        for length in (1200, 500)
    )
    assert fine.data.shape == (12, 2, 500)
    for channel in range(2):
        np.testing.assert_array_equal(
            fine.data[:, channel].ravel(), coarse.data[:, channel].ravel()
        )
    assert fine.start.tolist() == list(range(0, 6000, 500))


def test_fault_is_what_the_defects_add_to_an_unchanged_output():
    asked = SMALL | {"conditions": ("Normal", "IR", "OR-Ball"), "random_state": 5}
    rig = simulate_rig(**asked, return_fault=True)
    plain = simulate_rig(**asked)
    assert "fault" not in plain
    np.testing.assert_array_equal(rig.data, plain.data)
    assert rig.fault.shape == (len(rig.data), 1200)
    # Without the sources of the healthy bearing the output is the fault signal, and
    # vice versa.
    silent = Rig(friction_level=0.0, noise_level=0.0, torque_leak=())
    alone = simulate_rig(**asked, rig=silent, return_fault=True)
    np.testing.assert_allclose(rig.fault, alone.data[:, 0], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(rig.fault, alone.fault)
    without = simulate_rig(**asked, rig=Rig(impact_level=0.0, rubbing_level=0.0))
    np.testing.assert_allclose(
        rig.data[:, 0] - rig.fault, without.data[:, 0], rtol=0, atol=1e-14
    )
    faulty = rig.target != "Normal"
    assert np.all(rig.fault[~faulty] == 0)
    assert rig.fault[faulty].std(axis=1).min() > 1e-4


def test_output_keeps_its_values():
    # Printed tables rest on them.
    rig = simulate_rig(
        rpm=(250, 500),
        crack_mm=(1, 5),
        n_samples=12_000,
        random_state=3,
        return_fault=True,
    )
    emission, torque = rig.data[:, 0], rig.data[:, 1]
    assert np.sum(emission**2) == pytest.approx(94.65552584031477, rel=1e-9)
    assert np.sum(np.abs(np.diff(emission))) == pytest.approx(
        1823.9463020382584, rel=1e-9
    )
    assert np.sum(torque**3) == pytest.approx(2888208.545562112, rel=1e-9)


def test_random_state_decides_everything_random():
    draws = [
        simulate_rig(**SMALL, conditions="Ball", random_state=seed).data
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.any(draws[0] == draws[2])
    state = np.random.RandomState(1)
    from_state = simulate_rig(**SMALL, conditions="Ball", random_state=state).data
    np.testing.assert_array_equal(from_state, draws[0])
    assert not np.any(
        simulate_rig(**SMALL, conditions="Ball", random_state=state).data == draws[0]
    )


def test_a_recording_does_not_depend_on_what_else_is_generated(default_rig):
    alone = simulate_rig(
        rpm=450, crack_mm=6, conditions="IR-Ball", n_samples=24_000
    ).data
    among = select(default_rig, rpm=450, crack_mm=6, target="IR-Ball")
    np.testing.assert_array_equal(alone, among)


def test_recordings_are_independent_of_one_another():
    # Without defects, whose emission single and compound recordings share.
    silent = Rig(impact_level=0.0, rubbing_level=0.0)
    rig = simulate_rig(rpm=(400, 500), rig=silent, n_samples=24_000)
    emission = rig.data[:, 0].reshape(30, -1)
    fluctuation = np.diff(rig.data[:, 1].reshape(30, -1))
    for signals in (emission, fluctuation):
        correlation = np.corrcoef(signals) - np.eye(30)
        assert np.abs(correlation).max() < 0.2


def test_compound_faults_are_superpositions():
    quiet = Rig(friction_level=0.0, noise_level=0.0, torque_leak=())
    rig = simulate_rig(**SMALL, rig=quiet)
    single = {name: select(rig, target=name)[:, 0] for name in ("IR", "OR", "Ball")}
    for compound in ("IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"):
        together = select(rig, target=compound)[:, 0]
        expected = sum(single[name] for name in compound.split("-"))
        assert np.abs(expected).max() > 1e-3
        np.testing.assert_allclose(together, expected, rtol=0, atol=1e-15)
    assert np.all(select(rig, target="Normal")[:, 0] == 0)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"rpm": 0}, ValueError, "rpm == 0"),
        ({"rpm": (300, 300)}, ValueError, r"rpm == \(300, 300\), expected different"),
        ({"rpm": ()}, ValueError, r"rpm .* \(\)"),
        ({"rpm": "fast"}, ValueError, "rpm .* 'fast'"),
        ({"crack_mm": np.nan}, ValueError, "crack_mm .* nan"),
        ({"crack_mm": (3, 8)}, ValueError, r"crack_mm == \(3, 8\), .* 7.94 mm"),
        ({"conditions": ["IR", "Cage"]}, ValueError, "conditions .* 'Cage'"),
        (
            {"conditions": ["IR", "IR"]},
            ValueError,
            "conditions == .*, expected different",
        ),
        ({"conditions": []}, ValueError, r"conditions == \[\]"),
        ({"n_samples": 1000}, ValueError, "n_samples == 1000, .* window_length=1200"),
        ({"n_samples": 0}, ValueError, "n_samples == 0"),
        ({"n_samples": 1200.0}, TypeError, "n_samples"),
        ({"window_length": 0}, ValueError, "window_length == 0"),
        ({"rig": Rig(sampling_rate=100e3)}, ValueError, "sampling_rate / 2 = 50000 Hz"),
        (
            {"rig": {"slip": 0.02}},
            TypeError,
            "rig must be an instance of .*Rig, not dict",
        ),
        ({"random_state": "seed"}, ValueError, "seed"),
    ],
)
def test_bad_input_is_refused_by_name_and_value(parameters, error, message):
    with pytest.raises(error, match=message):
        simulate_rig(**parameters)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"sampling_rate": 0.0}, ValueError, "sampling_rate == 0"),
        ({"bearing": "6205"}, TypeError, "bearing must be an instance of .*, not str"),
        (
            {"paths": (1,)},
            TypeError,
            "paths must be an instance of .*TransmissionPaths",
        ),
        ({"torque_leak": 0.1}, ValueError, "torque_leak == 0.1"),
        ({"torque_leak": (np.inf,)}, ValueError, "torque_leak .*inf"),
        ({"torque_leak": ("a",)}, ValueError, "torque_leak .*'a'"),
        ({"slip": 0.2}, ValueError, "slip == 0.2"),
        ({"load_distribution": 0.0}, ValueError, "load_distribution == 0"),
        ({"impact_level": -1.0}, ValueError, "impact_level == -1"),
        ({"entry_ratio": np.inf}, ValueError, "entry_ratio == inf"),
        ({"friction_level": np.nan}, ValueError, "friction_level .* nan"),
        ({"rubbing_level": "high"}, TypeError, "rubbing_level"),
        ({"asperity_um": 0.0}, ValueError, "asperity_um == 0"),
        ({"noise_level": -1e-3}, ValueError, "noise_level == -0.001"),
    ],
)
def test_impossible_rigs_are_refused(parameters, error, message):
    with pytest.raises(error, match=message):
        Rig(**parameters)
