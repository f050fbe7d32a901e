import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels import observer_bank
from skarxlag.kernels.spectra import frequency_grid

POLE, STEP = 0.3, 0.05


def coloured(n_windows, n_samples, seed=0):
    noise = np.random.default_rng(seed).normal(size=(n_windows, n_samples))
    return noise * np.where(np.arange(n_samples) % 150 < 10, 5.0, 1.0)


def literal_estimates(samples, kp, ki, bound):
    """The recursion as it stands in the docstring, one member and one sample at a time."""
    c = p = d = 0.0
    estimates = []
    for sample in samples:
        e = sample - c
        c = POLE * c + kp * e + d
        p = p + ki * e
        d = (1 + min(abs(p), bound)) * p
        estimates.append(d)
    return np.array(estimates)


def literal_levels(samples, kp, ki, bound):
    sizes = np.abs(literal_estimates(samples, kp, ki, bound))
    log_gain = 0.5 * np.log(np.mean(sizes**2))
    power, path = 2 * log_gain, []
    settling = sizes[: 256 - -len(sizes) % 4]
    for size in [*settling, *sizes]:
        log_gain += STEP * np.sign(size - np.exp(log_gain))
        path.append(log_gain)
    return power, 2 * np.mean(path[len(settling) :])


@pytest.mark.parametrize("n_samples", [1, 3, 4, 5, 310])
@pytest.mark.parametrize("n_members", [2, 65])
@pytest.mark.parametrize("share", [0.0, 0.05])
def test_levels_against_the_literal_recursion(n_samples, n_members, share):
    signals = coloured(2, n_samples)
    kp, ki = observer_bank.member_gains(POLE, n_members, 0.96)
    bound = share * ((1 - POLE + kp) / ki - 1)
    power, gain = observer_bank.bank_levels(signals, POLE, kp, ki, bound, STEP)
    assert power.shape == gain.shape == (2, n_members)
    for w, samples in enumerate(signals):
        unit = 2 * np.log(np.abs(samples).max())
        for m in range(n_members):
            expected = literal_levels(samples, kp[m], ki[m], bound[m])
            assert power[w, m] + unit == pytest.approx(expected[0], abs=1e-3)
            # Rounding may turn a vote, which moves the mean by two steps over the
            # samples left.
            assert gain[w, m] + unit == pytest.approx(expected[1], abs=0.03)


def test_sums_over_long_windows_keep_their_precision():
    signals = coloured(1, 200_001)
    kp, ki = observer_bank.member_gains(POLE, 2, 0.31)
    power, gain = observer_bank.bank_levels(signals, POLE, kp, ki, np.zeros(2), STEP)
    unit = 2 * np.log(np.abs(signals).max())
    for m in range(2):
        expected = literal_levels(signals[0], kp[m], ki[m], 0.0)
        assert power[0, m] + unit == pytest.approx(expected[0], abs=1e-3)
        assert gain[0, m] + unit == pytest.approx(expected[1], abs=0.005)


@pytest.mark.parametrize("pole", [-0.7, 0.0, 0.3, 0.9])
@pytest.mark.parametrize("radius", [0.1, 0.9, 0.99])
def test_gains_place_the_closed_loop_poles(pole, radius):
    n_members = 16
    kp, ki = observer_bank.member_gains(pole, n_members, radius)
    for m, frequency in enumerate(frequency_grid(n_members)):
        poles = np.linalg.eigvals([[pole - kp[m], 1.0], [-ki[m], 1.0]])
        assert_allclose(np.abs(poles), radius, rtol=1e-7)
        assert_allclose(np.sort(np.abs(np.angle(poles))), frequency, rtol=1e-5)


@pytest.mark.parametrize("scale", [1e-300, 1e-20, 1e20, 1e300])
def test_linear_levels_do_not_depend_on_the_unit(scale):
    signals = coloured(2, 300)
    kp, ki = observer_bank.member_gains(POLE, 8, 0.82)
    plain, scaled = (
        observer_bank.bank_levels(s, POLE, kp, ki, np.zeros(8), STEP)
        for s in (signals, scale * signals)
    )
    assert_allclose(scaled, plain, atol=0.02)


def test_odd_windows_have_finite_levels():
    k = np.arange(101.0)
    signals = np.stack([0 * k, 1 + 0 * k, (k == 50), 1e300 * (-1) ** k, 1e-300 * k])
    kp, ki = observer_bank.member_gains(POLE, 8, 0.74)
    for bound in (0.0, 0.01):
        levels = observer_bank.bank_levels(
            signals, POLE, kp, ki, np.full(8, bound), STEP
        )
        assert np.isfinite(levels).all()
    power, gain = levels
    assert_allclose(power[0], np.log(1e-12), rtol=1e-5)
    assert_allclose(gain[0], power[0], atol=0.2)


def test_each_window_is_worked_on_by_itself():
    signals = coloured(5, 203)
    kp, ki = observer_bank.member_gains(POLE, 40, 0.94)
    arguments = POLE, kp, ki, np.full(40, 0.01), STEP
    together = observer_bank.bank_levels(signals, *arguments)
    for w in range(5):
        alone = observer_bank.bank_levels(signals[w : w + 1], *arguments)
        for one, all_ in zip(alone, together, strict=True):
            assert_array_equal(one[0], all_[w])
