import numpy as np
import pytest
from scipy.fft import dct
from scipy.spatial.distance import cdist

from skarxlag import LogSpectra, SpectralDistance, ThresholdLadder, make_extended_state_pio
from skarxlag.kernels.drift import scaled_frequency

N_FREQUENCIES = 24


def spectra(n_windows=30, n_groups=3, seed=0, tilt=0.0):
    """Log spectra of three conditions: each group has another ripple in each condition."""
    rng = np.random.default_rng(seed)
    frequency = (np.arange(N_FREQUENCIES) + 0.5) / N_FREQUENCIES
    y = np.repeat(["a", "b", "c"], n_windows)
    ripple = np.array(
        [[np.cos(np.pi * (3 + 2 * c + g) * frequency) for g in range(n_groups)] for c in range(3)]
    )
    X = np.repeat(0.3 * ripple, n_windows, axis=0) + tilt * frequency
    return X + 0.2 * rng.normal(size=X.shape), y


def cosines(X):
    return dct(X, type=2, norm="ortho", axis=-1)[..., 1:] * np.sqrt(2 / X.shape[-1])


def literal_distance(X_train, y, X, smooth=0.1, rough=0.01, scaled=0.1):
    """The docstring's formula for the groups in X, joined, with general-purpose tools."""

    def joined(array):
        return cosines(array).reshape(len(array), -1)

    means = np.stack([X_train[y == c].mean(axis=0) for c in np.unique(y)])
    deviations = joined(X_train) - joined(means)[np.unique(y, return_inverse=True)[1]]
    n = np.tile(np.arange(1, X.shape[-1]), X.shape[1])
    moved = [[scaled_frequency(m) for m in condition[:, np.newaxis]] for condition in means]
    shifts = joined(np.concatenate(np.transpose(moved, (0, 2, 1, 3))))
    covariance = (
        np.cov(deviations.T, bias=True)
        + np.diag(smooth / n**2 + rough)
        + scaled * shifts.T @ shifts / len(shifts)
    )
    distance = cdist(joined(X), joined(means), "mahalanobis", VI=np.linalg.inv(covariance))
    return distance / np.sqrt(len(n))


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_residual_is_the_formula_of_the_docstring(weight):
    X, y = spectra()
    fresh, _ = spectra(5, seed=1)
    groups = [literal_distance(X[:, [g]], y, fresh[:, [g]]) for g in range(3)]
    joint = literal_distance(X, y, fresh)
    expected = np.prod(groups, axis=0) ** ((1 - weight) / 3) * joint**weight
    fitted = SpectralDistance(joint_weight=weight).fit(X, y)
    np.testing.assert_allclose(fitted.transform(fresh), expected, rtol=1e-9)


@pytest.mark.parametrize("groups", [(0, 2), (1,), [2, 0, 1]])
def test_joint_distance_of_chosen_groups(groups):
    X, y = spectra()
    fresh, _ = spectra(5, seed=1)
    fitted = SpectralDistance(joint_weight=1.0, joint_groups=groups).fit(X, y)
    expected = literal_distance(X[:, groups], y, fresh[:, groups])
    np.testing.assert_allclose(fitted.transform(fresh), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("parameters", "literal"),
    [
        ({"smooth_drift": 1.0}, {"smooth": 1.0}),
        ({"rough_drift": 0.2}, {"rough": 0.2}),
        ({"frequency_drift": 3.0}, {"scaled": 3.0}),
    ],
)
def test_each_drift_enters_the_covariance(parameters, literal):
    X, y = spectra(n_groups=1)
    fitted = SpectralDistance(**parameters).fit(X, y)
    np.testing.assert_allclose(fitted.transform(X), literal_distance(X, y, X, **literal), rtol=1e-9)


def test_two_axes_are_one_group_whatever_the_joint_weight():
    X, y = spectra(n_groups=1)
    flat = SpectralDistance(joint_weight=0.7).fit(X[:, 0], y)
    np.testing.assert_allclose(
        flat.transform(X[:, 0]), SpectralDistance().fit(X, y).transform(X), rtol=1e-12
    )
    assert flat.whiteners_.shape == (1, N_FREQUENCIES - 1, N_FREQUENCIES - 1)


def test_a_gain_of_each_group_does_not_count():
    X, y = spectra()
    fitted = SpectralDistance(joint_weight=0.5).fit(X, y)
    shifted = X + np.array([3.0, -20.0, 100.0])[:, np.newaxis]
    np.testing.assert_allclose(fitted.transform(shifted), fitted.transform(X), rtol=1e-9)


def test_one_group_that_speed_has_moved_does_not_outvote_the_others():
    X, y = spectra()
    broken = X.copy()
    broken[:, 1] = 3 * X[np.roll(np.arange(len(X)), 30), 1]
    verdicts = {
        weight: np.unique(y)[
            SpectralDistance(joint_weight=weight).fit(X, y).transform(broken).argmin(axis=1)
        ]
        for weight in (0.0, 1.0)
    }
    assert np.mean(verdicts[0.0] == y) > 0.9
    assert np.mean(verdicts[0.0] == y) > np.mean(verdicts[1.0] == y) + 0.2


def test_drift_discounts_what_is_smooth_over_frequency():
    X, y = spectra()
    tilted, _ = spectra(tilt=2.0)
    own = np.unique(y, return_inverse=True)[1]

    def moved(smooth):
        fitted = SpectralDistance(smooth_drift=smooth).fit(X, y)
        index = np.arange(len(X))
        return np.mean(fitted.transform(tilted)[index, own] / fitted.transform(X)[index, own])

    assert moved(1.0) < moved(0.1) < moved(0.0)


@pytest.mark.parametrize("weight", [0.0, 0.5, 1.0])
def test_adapt_moves_all_references_by_what_the_healthy_windows_say(weight):
    X, y = spectra()
    tilted, _ = spectra(tilt=2.0, seed=1)
    own, index = np.unique(y, return_inverse=True)[1], np.arange(len(X))
    fitted = SpectralDistance(joint_weight=weight).fit(X, y)
    before = fitted.transform(tilted)[index, own]
    assert fitted.adapt(tilted[y == "a"], y[y == "a"]) is fitted
    after = fitted.transform(tilted)[index, own]
    for condition in "abc":
        assert after[y == condition].mean() < 0.8 * before[y == condition].mean()


def test_adapt_by_the_formula_of_the_docstring():
    X, y = spectra(n_groups=1)
    fresh, _ = spectra(4, n_groups=1, seed=3, tilt=1.0)
    fitted = SpectralDistance().fit(X, y)
    W, before = fitted.whiteners_[0], fitted.references_[:, 0]
    healthy = np.repeat("a", 4)
    moved = cosines(fresh[:4, 0]).mean(axis=0) - np.linalg.solve(W.T, before[0])
    C = np.diag(0.1 / np.arange(1.0, N_FREQUENCIES) ** 2)
    expected = before + C @ W @ W.T @ moved @ W
    fitted.adapt(fresh[:4], healthy)
    np.testing.assert_allclose(fitted.references_[:, 0], expected, rtol=1e-9, atol=1e-12)


def test_adapt_to_the_training_windows_changes_nothing():
    X, y = spectra()
    fitted = SpectralDistance(joint_weight=0.5).fit(X, y)
    before = fitted.transform(X)
    np.testing.assert_allclose(fitted.adapt(X, y).transform(X), before, rtol=1e-9)


def test_adapt_refuses_conditions_that_were_not_in_fit():
    X, y = spectra(4)
    with pytest.raises(ValueError, match=r"\['worn'\].*expected among \['a', 'b', 'c'\]"):
        SpectralDistance().fit(X, y).adapt(X[:2], ["worn", "a"])


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_fit_transform_is_fit_and_transform(dtype):
    X, y = spectra()
    X = X.astype(dtype)
    X.flags.writeable = False
    together = SpectralDistance(joint_weight=0.5).fit_transform(X, y)
    fitted = SpectralDistance(joint_weight=0.5).fit(X, y)
    np.testing.assert_array_equal(together, fitted.transform(X))
    assert together.dtype == dtype
    alone = np.concatenate([fitted.transform(x[np.newaxis]) for x in X[::7]])
    np.testing.assert_array_equal(alone, together[::7])
    np.testing.assert_array_equal(fitted.transform(np.asfortranarray(X)), together)


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("joint_weight", -0.1),
        ("joint_weight", 1.1),
        ("smooth_drift", -0.1),
        ("smooth_drift", np.nan),
        ("rough_drift", 0.0),
        ("rough_drift", np.inf),
        ("frequency_drift", -1.0),
        ("joint_groups", ()),
        ("joint_groups", (0, 0)),
        ("joint_groups", (0, 3)),
    ],
)
def test_parameters_out_of_range_are_named(parameter, value):
    X, y = spectra(4)
    with pytest.raises(ValueError, match=parameter):
        SpectralDistance(**{parameter: value}).fit(X, y)


def test_spectra_of_another_shape_are_refused():
    X, y = spectra(4)
    fitted = SpectralDistance().fit(X, y)
    with pytest.raises(ValueError, match=r"shape \(3, 23\), but .* of shape \(3, 24\)"):
        fitted.transform(X[..., :-1])
    with pytest.raises(ValueError, match=r"values up to 1e\+05, expected natural logarithms"):
        fitted.transform(X + 1e5)


def test_a_group_that_is_the_same_everywhere_leaves_the_verdict_to_the_others():
    X, y = spectra()
    constant = np.concatenate([X, np.zeros_like(X[:, :1])], axis=1)
    with_it, without = (SpectralDistance().fit(a, y).transform(a) for a in (constant, X))
    np.testing.assert_array_equal(with_it.argmin(axis=1), without.argmin(axis=1))


def test_a_single_frequency_tells_nothing():
    X, y = spectra(4)
    residuals = SpectralDistance(joint_weight=0.5).fit_transform(X[..., :1], y)
    np.testing.assert_allclose(residuals, np.full((12, 3), 1e-6))


def test_names_are_those_of_the_conditions():
    X, y = spectra(4)
    names = SpectralDistance().fit(X, y).get_feature_names_out()
    assert names.tolist() == ["a_distance", "b_distance", "c_distance"]


@pytest.mark.parametrize(
    "name", ["whiteners_", "references_", "joint_whitener_", "joint_references_"]
)
@pytest.mark.parametrize("change", [lambda a: a[:, 1:], lambda a: a + np.nan])
def test_a_state_that_is_not_possible_is_named(name, change):
    X, y = spectra(4)
    fitted = SpectralDistance(joint_weight=0.5).fit(X, y)
    setattr(fitted, name, change(getattr(fitted, name)))
    for use in (lambda: fitted.transform(X), lambda: fitted.adapt(X, y)):
        with pytest.raises(ValueError, match=name):
            use()


def test_verdicts_through_measures_and_ladder():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(60, 600)) + np.cumsum(rng.normal(size=(60, 600)), axis=1) * (
        0.1 * (np.arange(60) % 2)[:, np.newaxis]
    )
    y = np.arange(60) % 2
    residuals = SpectralDistance().fit_transform(LogSpectra().fit_transform(X[:30]), y[:30])
    assert ThresholdLadder().fit(residuals, y[:30]).score(residuals, y[:30]) == 1.0
    assert make_extended_state_pio().fit(X[:30], y[:30]).score(X[30:], y[30:]) > 0.9
