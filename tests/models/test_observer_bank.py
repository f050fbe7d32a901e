from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag import ExtendedStatePIObserverBank
from skarxlag.kernels import observer
from skarxlag.kernels.observer_bank import bank_levels
from skarxlag.models import observers

LINEAR = partial(ExtendedStatePIObserverBank, saturation=0.0, bandwidth=1.0)
BANKS = [LINEAR, ExtendedStatePIObserverBank]


@pytest.fixture(scope="module")
def innovations():
    return np.random.default_rng(0).normal(size=(70, 2, 200))


@pytest.mark.parametrize("make", BANKS)
def test_transform_is_the_kernel(make, innovations):
    bank = make(n_members=8).fit(innovations)
    groups = bank.transform(innovations)
    assert groups.shape == (70, 6, 8)
    for model in (0, 1):
        power, gain = bank_levels(
            innovations[:, model], 0.3, bank.kp_, bank.ki_, bank.bounds_, 0.05
        )
        assert_array_equal(groups[:, 3 * model], power)
        assert_array_equal(groups[:, 3 * model + 1], gain)
        assert_array_equal(groups[:, 3 * model + 2], gain - power)
    names = bank.get_feature_names_out(["a", "b"]).tolist()
    assert names[:4] == ["a_power", "a_switching_gain", "a_steadiness", "b_power"]


@pytest.mark.parametrize("pole", [-0.5, 0.0, 0.3, 0.8])
@pytest.mark.parametrize("n_members", [8, 64])
def test_every_member_is_certified(pole, n_members, innovations):
    linear = LINEAR(pole=pole, n_members=n_members).fit(innovations)
    loops = [
        observer.loop_matrix(pole, *gains)
        for gains in zip(linear.kp_, linear.ki_, strict=True)
    ]
    radii = np.abs(np.linalg.eigvals(loops)).max(axis=1)
    assert_allclose(radii, np.exp(-np.pi / 2 / n_members), rtol=1e-6)
    bank = ExtendedStatePIObserverBank(pole=pole, n_members=n_members).fit(innovations)
    assert (bank.bounds_ > 0).all()
    for m in range(n_members):
        P = bank.lyapunov_[m]
        assert np.linalg.eigvalsh(P)[0] > 0
        for gain in (1.0, 1 + bank.bounds_[m] / 3, 1 + bank.bounds_[m]):
            A = observer.loop_matrix(pole, bank.kp_[m], bank.ki_[m], gain)
            assert np.linalg.eigvalsh(A.T @ P @ A - P)[-1] < 0


def test_saturation_limits_the_bounds(innovations):
    free = ExtendedStatePIObserverBank(saturation=100.0).fit(innovations)
    limited = ExtendedStatePIObserverBank(saturation=0.02).fit(innovations)
    assert free.bounds_.max() > 0.5
    assert limited.bounds_.max() == 0.02
    assert np.all(
        ExtendedStatePIObserverBank(saturation=0.0).fit(innovations).bounds_ == 0
    )


@pytest.mark.parametrize("make", BANKS)
@pytest.mark.parametrize(
    ("parameter", "value"),
    [("pole", 1.0), ("n_members", 1), ("bandwidth", 0.0), ("bandwidth", np.inf)],
)
def test_parameters_out_of_range_are_named(make, parameter, value, innovations):
    with pytest.raises(ValueError, match=parameter):
        make(**{parameter: value}).fit(innovations)


def test_each_certificate_is_tried_once(innovations, monkeypatch):
    tried = []
    monkeypatch.setattr(
        observers.observer, "common_lyapunov", lambda *loops: tried.append(loops)
    )
    with pytest.raises(ValueError, match="certifies member 0"):
        # No other test has a bank of this pole, so that its certificates are not known.
        ExtendedStatePIObserverBank(saturation=0.0, pole=0.123).fit(innovations)
    assert len(tried) == 1


def test_members_without_room_for_a_certificate_are_refused(innovations):
    with pytest.raises(ValueError, match="certifies member 0"):
        LINEAR(bandwidth=1e-20).fit(innovations)
    with pytest.raises(ValueError, match="certifies member 0"):
        ExtendedStatePIObserverBank(bandwidth=1e-20).fit(innovations)
    with pytest.raises(ValueError, match="saturation"):
        ExtendedStatePIObserverBank(saturation=-1.0).fit(innovations)


@pytest.mark.parametrize("make", BANKS)
def test_type_layout_and_threads(make, innovations):
    single = innovations.astype(np.float32)
    single.flags.writeable = False
    groups = make().fit_transform(single)
    assert groups.dtype == np.float32
    assert_array_equal(make().fit_transform(np.asfortranarray(single)), groups)
    assert_array_equal(make(n_jobs=2).fit_transform(single), groups)


@pytest.mark.parametrize("make", BANKS)
@pytest.mark.parametrize("name", ["kp_", "ki_", "bounds_"])
@pytest.mark.parametrize("value", [np.zeros(3), np.full(64, np.nan)])
def test_a_state_that_is_not_possible_is_named(make, name, value, innovations):
    bank = make().fit(innovations)
    setattr(bank, name, value)
    with pytest.raises(ValueError, match=name):
        bank.transform(innovations)
