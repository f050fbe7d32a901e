import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.signal import lfilter
from scipy.spatial.distance import cdist

from skarxlag import ARXLaguerre, CepstralResidual, ThresholdLadder, make_diagnoser
from skarxlag.kernels import drift, spectra

POLYNOMIALS = {"a": [1, -0.9], "b": [1, 0.3, 0.5], "c": [1, -1.2, 0.8]}


def windows(n_windows=30, n_samples=600, seed=0):
    noise = np.random.default_rng(seed).normal(size=(3, n_windows, n_samples + 200))
    X = [
        lfilter([1], polynomial, e, axis=1)[:, 200:]
        for polynomial, e in zip(POLYNOMIALS.values(), noise, strict=True)
    ]
    return np.concatenate(X), np.repeat(list(POLYNOMIALS), n_windows)


def literal_distances(X_train, y, X, order=20, n=10, segment=32):
    """The docstring's formula, with general-purpose tools."""

    def log_spectra(windows):
        return (
            spectra.autoregressive_log_spectrum(windows, order, 256),
            np.subtract(*spectra.short_time_log_spectra(windows, segment, segment // 8)[::-1]),
        )

    def cepstra(colour, steadiness):
        return np.hstack([spectra.cepstrum(colour)[:, :n], spectra.cepstrum(steadiness)])

    train = log_spectra(X_train)
    means = [np.stack([s[y == c].mean(axis=0) for c in np.unique(y)]) for s in train]
    references = cepstra(*means)
    deviations = cepstra(*train) - references[np.unique(y, return_inverse=True)[1]]
    S_w = np.cov(deviations.T, bias=True)
    m = means[1].shape[1] - 1
    S_v = block_diag(*[np.diag(0.1 / np.arange(1, k + 1) ** 2 + 0.01) for k in (n, m)])
    shifted = cepstra(*[drift.scaled_frequency(s) for s in means])
    noisy = cepstra(drift.raised_noise(means[0]), np.zeros((6, m + 1)))
    S_s, S_n = shifted.T @ shifted / len(shifted), noisy.T @ noisy / len(noisy)
    covariance = S_w + S_v + 0.1 * S_s + 0.5 * S_n
    inverse = np.linalg.inv(covariance)
    distances = cdist(cepstra(*log_spectra(X)), references, "mahalanobis", VI=inverse)
    return distances / np.sqrt(n + m)


def test_residual_is_the_mahalanobis_distance_of_the_docstring():
    X, y = windows()
    fitted = CepstralResidual(spectrum_order=20, n_coefficients=10, segment=32).fit(X, y)
    fresh, _ = windows(5, seed=1)
    np.testing.assert_allclose(fitted.transform(fresh), literal_distances(X, y, fresh), rtol=1e-8)


def test_each_condition_is_nearest_to_its_own_windows():
    X, y = windows()
    fresh, y_fresh = windows(20, seed=1)
    residuals = CepstralResidual().fit(X, y).transform(fresh)
    assert np.mean(np.array(list("abc"))[residuals.argmin(axis=1)] == y_fresh) > 0.95


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_residuals_do_not_depend_on_the_unit(scale):
    X, y = windows(8)
    fitted = CepstralResidual().fit(X, y)
    np.testing.assert_allclose(fitted.transform(scale * X), fitted.transform(X), rtol=1e-5)


def test_a_models_own_spectrum_cancels():
    X, y = windows(40, 2400)
    fresh, _ = windows(10, 2400, seed=1)
    plain = CepstralResidual().fit(X, y).transform(fresh)
    for model in (ARXLaguerre(order=4, bank=False), ARXLaguerre(order=4)):
        through_model = CepstralResidual().fit(model.fit_transform(X, y), y)
        ratio = through_model.transform(model.transform(fresh)) / plain
        assert abs(np.median(ratio) - 1) < 0.1


@pytest.mark.parametrize(
    "change",
    [
        {"spectrum_order": 8},
        {"n_coefficients": 16},
        {"segment": 32},
        {"smooth_drift": 1.0},
        {"rough_drift": 0.3},
        {"frequency_drift": 2.0},
        {"noise_drift": 5.0},
    ],
)
def test_every_parameter_has_an_effect(change):
    X, y = windows(10)
    default = CepstralResidual().fit_transform(X, y)
    assert np.abs(CepstralResidual(**change).fit_transform(X, y) - default).max() > 1e-3


def test_parameters_are_all_in_the_test_above():
    assert len(CepstralResidual().get_params()) == 7 + 1  # and n_jobs


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("spectrum_order", 0),
        ("n_coefficients", 0),
        ("n_coefficients", 256),
        ("segment", 3),
        ("smooth_drift", -0.1),
        ("rough_drift", 0.0),
        ("frequency_drift", -1.0),
        ("noise_drift", -1.0),
        ("smooth_drift", np.nan),
        ("rough_drift", np.inf),
    ],
)
def test_parameters_out_of_range_are_named(parameter, value):
    X, y = windows(4)
    with pytest.raises(ValueError, match=parameter):
        CepstralResidual(**{parameter: value}).fit(X, y)


def test_drift_discounts_what_a_smooth_filter_changes():
    X, y = windows(40)
    tilted = lfilter([1, 0.4], [1], X, axis=1)

    def moved(**drifts):
        fitted = CepstralResidual(**drifts).fit(X, y)
        own = np.unique(y, return_inverse=True)[1]
        index = np.arange(len(X))
        return np.mean(fitted.transform(tilted)[index, own] / fitted.transform(X)[index, own])

    assert moved(smooth_drift=1.0) < moved(smooth_drift=0.1) < moved(smooth_drift=0.0)


def test_adapt_moves_all_references_by_what_the_healthy_windows_say():
    X, y = windows(40)
    new_speed = lfilter([1, 0.6], [1], X, axis=1)
    fitted = CepstralResidual().fit(X, y)
    own = np.unique(y, return_inverse=True)[1]
    before = fitted.transform(new_speed)[np.arange(len(X)), own]
    healthy = y == "a"
    after = fitted.adapt(new_speed[healthy], y[healthy]).transform(new_speed)
    after = after[np.arange(len(X)), own]
    for condition in "abc":
        assert after[y == condition].mean() < 0.9 * before[y == condition].mean()


def test_adapt_to_the_training_windows_changes_nothing():
    X, y = windows(10)
    fitted = CepstralResidual().fit(X, y)
    before = fitted.transform(X)
    np.testing.assert_allclose(fitted.adapt(X, y).transform(X), before, rtol=1e-9)


def test_adapt_refuses_conditions_that_were_not_in_fit():
    X, y = windows(4)
    with pytest.raises(ValueError, match=r"\['worn'\].*expected among \['a', 'b', 'c'\]"):
        CepstralResidual().fit(X, y).adapt(X[:2], ["worn", "a"])


def test_innovations_of_some_other_number_of_models_are_refused():
    X, y = windows(4)
    with pytest.raises(ValueError, match="2 models, expected 1 or one for each of the 3"):
        CepstralResidual().fit(np.stack([X, X], axis=1), y)


def test_a_bank_compares_each_condition_with_its_own_models_innovations():
    X, y = windows()
    innovations = ARXLaguerre(order=4).fit_transform(X, y)
    residuals = CepstralResidual().fit_transform(innovations, y)
    verdicts = ThresholdLadder().fit(residuals, y).predict(residuals)
    assert np.mean(verdicts == y) > 0.95


def test_results_do_not_depend_on_batches_or_threads():
    X, y = windows()
    fitted = make_diagnoser().fit(X, y)
    residuals = fitted[:-1].transform(X)
    alone = np.concatenate([fitted[:-1].transform(x[np.newaxis]) for x in X[::9]])
    np.testing.assert_array_equal(residuals[::9], alone)
    np.testing.assert_array_equal(make_diagnoser(n_jobs=2).fit(X, y)[:-1].transform(X), residuals)


K = np.arange(600)


@pytest.mark.parametrize(
    "odd",
    [0 * K, 3 + 0 * K, np.sin(0.3 * K), 3 + (K == 300), K, np.exp(K - 600.0), 1e300 * (-1.0) ** K],
)
def test_an_odd_window_has_residuals_and_changes_nothing_for_the_others(odd):
    X, y = windows(6)
    fitted = CepstralResidual().fit(X, y)
    residuals = fitted.transform(np.concatenate([X, odd[np.newaxis]]))
    np.testing.assert_array_equal(residuals[:-1], fitted.transform(X))
    assert np.isfinite(residuals).all()


def test_windows_of_any_type_and_layout():
    X, y = windows(6)
    X = X.astype(np.float32)
    X.flags.writeable = False
    fitted = CepstralResidual().fit(X, y)
    residuals = fitted.transform(X)
    assert residuals.dtype == np.float32
    same = CepstralResidual().fit(X.astype(np.float64), y).transform(X.astype(np.float64))
    np.testing.assert_array_equal(residuals, same.astype(np.float32))
    np.testing.assert_array_equal(fitted.transform(np.asfortranarray(X)), residuals)
    np.testing.assert_array_equal(fitted.transform(np.repeat(X, 2, axis=1)[:, ::2]), residuals)


@pytest.mark.parametrize("n_models", [0, 1, 3])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_fit_transform_is_fit_and_transform(n_models, dtype):
    rng = np.random.default_rng(0)
    shape = (90, 300) if n_models == 0 else (90, n_models, 300)
    X, y = rng.normal(size=shape).astype(dtype), np.repeat(["a", "b", "c"], 30)
    once, twice = CepstralResidual(), CepstralResidual()
    together = once.fit_transform(X, y)
    np.testing.assert_array_equal(together, twice.fit(X, y).transform(X))
    assert together.dtype == dtype
    np.testing.assert_array_equal(once.references_, twice.references_)
