import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lfilter
from sklearn.base import clone

from skarxlag import ExtendedStatePIObserver, PIObserver
from skarxlag.models.observer_base import EVALUATIONS


@pytest.fixture
def innovations():
    return np.random.default_rng(0).normal(size=(5, 3, 400))


def transfer_function(observer, signals):
    pole, kp, ki = observer.pole, observer.kp, observer.ki
    return lfilter(
        [1, -(1 + pole), pole], [1, -(1 + pole - kp), pole - kp + ki], signals
    )


def test_power_is_the_rms_of_the_filtered_innovations(innovations):
    observer = PIObserver(pole=0.4, kp=0.3, ki=0.06).fit(innovations)
    error = transfer_function(observer, innovations)
    assert_allclose(observer.observe(innovations).error, error, atol=1e-11)
    assert_allclose(
        observer.transform(innovations), np.sqrt(np.mean(error**2, axis=-1)), rtol=1e-10
    )


def test_fault_estimate_is_the_sum_of_the_errors_so_far(innovations):
    observer = PIObserver().fit(innovations)
    estimate = lfilter(
        [0, observer.ki], [1, -1], transfer_function(observer, innovations)
    )
    assert_allclose(observer.observe(innovations).fault_estimate, estimate, atol=1e-11)
    assert_array_equal(observer.get_feature_names_out(["a", "b", "c"]), ["0", "1", "2"])
    observer.fit(innovations, list("zxyxz"))
    assert_array_equal(observer.get_feature_names_out(), ["x", "y", "z"])


def test_plain_windows_are_innovations_of_one_model(innovations):
    observer = PIObserver().fit(innovations[:, 0])
    assert_array_equal(
        observer.transform(innovations[:, 0]),
        PIObserver().fit_transform(innovations[:, :1]),
    )
    assert_array_equal(observer.get_feature_names_out(), ["0"])
    with pytest.raises(ValueError, match="fitted on windows of shape"):
        observer.transform(innovations)


def test_extended_observer_without_nonlinearity_is_the_linear_one(innovations):
    for evaluation in EVALUATIONS:
        settings = {"pole": 0.4, "kp": 0.3, "ki": 0.06, "evaluation": evaluation}
        linear = PIObserver(**settings)
        extended = ExtendedStatePIObserver(saturation=0.0, n_observers=1, **settings)
        assert_array_equal(
            extended.fit_transform(innovations), linear.fit_transform(innovations)
        )


def test_pi_observer_is_accepted_exactly_where_its_eigenvalues_are_inside_the_circle():
    rng = np.random.default_rng(0)
    X = np.zeros((1, 4))
    verdicts = []
    for _ in range(400):
        pole, kp, ki = rng.uniform(-0.99, 0.99), rng.uniform(-2, 3), rng.uniform(0, 4)
        ki *= rng.random() < 0.8
        # Simulated, not by the package's matrix: an impulse must have died.
        closed_loop = [1, -(1 + pole - kp), pole - kp + ki] if ki else [1, -(pole - kp)]
        radius = np.abs(np.roots(closed_loop)).max()
        a = pole - kp
        jury = (ki > 0 and a + ki < 1 and 2 * (1 + a) + ki > 0) or (
            ki == 0 and abs(a) < 1
        )
        assert jury == (radius < 1)
        observer = PIObserver(pole=pole, kp=kp, ki=ki)
        if jury:
            assert_array_equal(observer.fit(X).kp_, [kp])
        else:
            with pytest.raises(
                ValueError,
                match=r"unstable: with pole=.*kp=.*ki=.*, its spectral radius is .*Reduce ki",
            ):
                observer.fit(X)
        verdicts.append(jury)
    assert 0.1 < np.mean(verdicts) < 0.9


@pytest.mark.parametrize("amplitude", [1e-3, 1.0, 1e3])
def test_certified_observer_stays_bounded(amplitude):
    X = amplitude * np.random.default_rng(0).normal(size=(2, 20_000))
    error = ExtendedStatePIObserver(n_observers=1).fit(X).observe(X).error
    assert np.abs(error).max() < 20 * amplitude


def test_trajectories_agree_with_their_definitions(innovations):
    slope, layer, step = 0.5, 0.8, 0.05
    observer = PIObserver(
        sliding_slope=slope, boundary_layer=layer, adaptation_step=step
    )
    paths = observer.fit(innovations).observe(innovations)
    assert set(paths) == {
        "error", "fault_estimate", "sliding_surface", "switching_gain", "residual"
    }  # fmt: skip
    e = paths.error[1, 2]
    S = np.array([slope * e[k] + e[k] - e[max(k - 1, 0)] for k in range(len(e))])
    assert_allclose(paths.sliding_surface[1, 2], S, atol=1e-12)
    K, gains = np.sqrt(np.mean(S**2)), []
    for size in np.abs(S):
        K = K * np.exp(step * np.sign(size - K))
        gains.append(K)
    assert_allclose(paths.switching_gain[1, 2], gains, rtol=1e-9)
    r = [K * np.clip(s / (layer * K), -1, 1) for K, s in zip(gains, S, strict=True)]
    assert_allclose(paths.residual[1, 2], r, atol=1e-9)
    sharp = (
        observer.set_params(boundary_layer=0.0).fit(innovations).observe(innovations)
    )
    assert_allclose(sharp.residual[1, 2], gains * np.sign(S), rtol=1e-9)
    tail = gains[len(gains) // 2 :]
    observer.set_params(evaluation="switching_gain")
    assert observer.fit_transform(innovations)[1, 2] == pytest.approx(
        np.exp(np.log(tail).mean())
    )


def test_switching_gain_shrugs_strikes_off_and_power_does_not():
    X = np.random.default_rng(0).normal(size=(1, 5000))
    struck = X.copy()
    struck[0, ::100] += 50
    for evaluation, low, high in (("power", 2.0, 9.0), ("switching_gain", 0.9, 1.3)):
        observer = PIObserver(evaluation=evaluation).fit(X)
        assert low < (observer.transform(struck) / observer.transform(X)).item() < high


BAD = {
    "pole": [-1.0, 1.0, np.nan],
    "kp": [np.nan, np.inf],
    "evaluation": ["rms", None],
    "sliding_slope": [-0.1, np.nan, np.inf],
    "adaptation_step": [0.0, 1.1, np.nan],
    "boundary_layer": [-1.0, np.inf],
    "ki": [-0.1, np.nan],
    "n_observers": [0],
    "saturation": [-1.0, np.inf],
}


@pytest.mark.parametrize(
    "observer", [PIObserver(), ExtendedStatePIObserver(n_observers=1)], ids=str
)
def test_bad_parameters_are_named(observer):
    for name in set(BAD) & set(observer.get_params()):
        for value in BAD[name]:
            bad = clone(observer).set_params(**{name: value})
            with pytest.raises(ValueError, match=rf"^{name} (==|is missing)"):
                bad.fit(np.zeros((1, 4)))
        if name != "evaluation":
            with pytest.raises(TypeError, match=name):
                clone(observer).set_params(**{name: "much"}).fit(np.zeros((1, 4)))
