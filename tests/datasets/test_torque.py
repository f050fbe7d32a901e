import numpy as np
import pytest

from skarxlag.datasets.torque import DriveTorque, simulate_torque

# At 500 rpm and 250 kHz a turn is 30,000 samples, so every order of the shaft is a bin of its own.
RPM, SAMPLING_RATE, N_TURN = 500.0, 250e3, 30_000


def orders(torque, n_turns=2):
    u = simulate_torque(torque, RPM, n_turns * N_TURN, SAMPLING_RATE, np.random.default_rng(0))
    lines = 2 * np.abs(np.fft.rfft(u)) / len(u)
    lines[0] /= 2
    return lines[::n_turns]


def test_torque_has_its_mean_and_ripples_and_nothing_else():
    torque = DriveTorque(
        mean=3.0,
        shaft_ripple=0.02,
        mesh_ripple=0.04,
        gear_teeth=31,
        electrical_ripple=0.05,
        electrical_order=18,
        fluctuation=0.0,
    )
    lines = orders(torque)
    expected = {0: 3.0, 1: 0.06, 31: 0.12, 18: 0.15}
    for order, amplitude in expected.items():
        assert lines[order] == pytest.approx(amplitude, abs=1e-9)
    assert np.delete(lines, list(expected)).max() < 1e-9


def test_fluctuation_is_white_of_its_rms():
    torque = DriveTorque(shaft_ripple=0, mesh_ripple=0, electrical_ripple=0, fluctuation=0.05)
    u = simulate_torque(torque, RPM, 100_000, SAMPLING_RATE, np.random.default_rng(0)) - 2.0
    assert u.std() == pytest.approx(0.05, rel=0.02)
    assert abs(np.corrcoef(u[1:], u[:-1])[0, 1]) < 0.02


@pytest.mark.parametrize("name", list(vars(DriveTorque())))
@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_impossible_torques_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} .* {value}"):
        DriveTorque(**{name: value})
