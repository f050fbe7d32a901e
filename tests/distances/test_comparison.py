import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.fft import dct

from skarxlag import (
    SpectralDistance,
)
from skarxlag.kernels.drift import scaled_frequency

N_FREQUENCIES = 24


def spectra(n_windows=30, n_groups=3, seed=0, tilt=0.0):
    """Log spectra of three conditions: each group has another ripple in each condition."""
    rng = np.random.default_rng(seed)
    frequency = (np.arange(N_FREQUENCIES) + 0.5) / N_FREQUENCIES
    y = np.repeat(["a", "b", "c"], n_windows)
    ripple = np.array(
        [
            [np.cos(np.pi * (3 + 2 * c + g) * frequency) for g in range(n_groups)]
            for c in range(3)
        ]
    )
    X = np.repeat(0.3 * ripple, n_windows, axis=0) + tilt * frequency
    return X + 0.2 * rng.normal(size=X.shape), y


def cosines(X):
    return dct(X, type=2, norm="ortho", axis=-1)[..., 1:] * np.sqrt(2 / X.shape[-1])


@pytest.mark.parametrize(
    ("parameters", "literal"),
    [
        ({}, {}),
        ({"smooth_drift": 1.0}, {"smooth": 1.0}),
        ({"rough_drift": 0.2}, {"rough": 0.2}),
        ({"frequency_drift": 3.0}, {"scaled": 3.0}),
    ],
)
def test_residual_is_the_formula_of_the_docstring(parameters, literal):
    X, y = spectra()
    row = spectra(1, seed=1)[0][0]
    fitted = SpectralDistance(**parameters).fit(X, y)
    expected = literal_residual(X, y, np.ones(len(X)), row, **literal)
    assert_allclose(fitted.transform(row[np.newaxis])[0], expected, rtol=1e-9)


def test_two_axes_are_one_group():
    X, y = spectra(n_groups=1)
    flat = SpectralDistance().fit(X[:, 0], y)
    expected = SpectralDistance().fit(X, y).transform(X)
    assert_array_equal(flat.transform(X[:, 0]), expected)


def test_a_gain_of_each_group_does_not_count():
    X, y = spectra()
    fitted = SpectralDistance().fit(X, y)
    shifted = X + np.array([3.0, -20.0, 100.0])[:, np.newaxis]
    assert_allclose(fitted.transform(shifted), fitted.transform(X), rtol=1e-9)


def test_adapt_by_the_formula_of_the_docstring():
    X, y = spectra()
    fresh, _ = spectra(4, seed=3, tilt=1.0)
    fitted = SpectralDistance().fit(X, y)

    def references():
        """Cosine coefficients of the means: the axes have no others to map."""
        shapes = np.linalg.lstsq(fitted.axes_.T, fitted.references_[0].T)[0]
        return cosines(shapes.T.reshape(3, *X.shape[1:])).reshape(3, -1)

    before = references()
    scatter, drift = literal_covariances(X, y, np.ones(len(X)))
    n = np.tile(np.arange(1.0, N_FREQUENCIES), 3)
    change = cosines(fresh[:4]).reshape(4, -1).mean(axis=0) - before[0]
    expected = before + 0.3 / n**2 * np.linalg.solve(scatter + drift, change)
    fitted.adapt(fresh[:4], np.repeat("a", 4))
    assert_allclose(references(), expected, rtol=1e-8, atol=1e-10)


def test_adapt_refuses_conditions_that_were_not_in_fit():
    X, y = spectra(4)
    with pytest.raises(
        ValueError, match=r"'worn'\], expected conditions of fit, \['a', 'b', 'c'\]"
    ):
        SpectralDistance().fit(X, y).adapt(X[:2], ["worn", "a"])


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_fit_transform_is_fit_and_transform(dtype):
    X, y = spectra()
    X = X.astype(dtype)
    X.flags.writeable = False
    together = SpectralDistance().fit_transform(X, y)
    fitted = SpectralDistance().fit(X, y)
    assert_array_equal(together, fitted.transform(X))
    assert together.dtype == dtype
    alone = np.concatenate([fitted.transform(x[np.newaxis]) for x in X[::7]])
    assert_array_equal(alone, together[::7])
    assert_array_equal(fitted.transform(np.asfortranarray(X)), together)


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("smooth_drift", -0.1),
        ("smooth_drift", np.nan),
        ("rough_drift", 0.0),
        ("rough_drift", np.inf),
        ("frequency_drift", -1.0),
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
    with pytest.raises(
        ValueError, match=r"Largest size in X: 100000\..*, expected natural logarithms"
    ):
        fitted.transform(X + 1e5)


def test_a_single_frequency_has_no_information():
    X, y = spectra(4)
    residuals = SpectralDistance().fit_transform(X[..., :1], y)
    assert_allclose(residuals, np.full((12, 3), 1e-6))


def test_names_are_those_of_the_conditions():
    X, y = spectra(4)
    names = SpectralDistance().fit(X, y).get_feature_names_out()
    assert names.tolist() == ["a_distance", "b_distance", "c_distance"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("speeds_", np.array([900.0, 600.0])),
        ("recorded_", np.array([[1, 1, 0], [1, 1, 0]])),
        ("variances_", np.full(3 * (N_FREQUENCIES - 1), -1.0)),
    ],
)
def test_a_state_over_speeds_that_is_not_possible_is_named(name, value):
    X, y = spectra(4)
    fitted = SpectralDistance().fit(X, y, rpm=np.tile([600.0, 900.0], 6))
    setattr(fitted, name, value)
    with pytest.raises(ValueError, match=name):
        fitted.transform(X)


def over_speeds(rpm, seed=0):
    """Log spectra whose tilt follows the speed, those of condition c twice as much."""
    X, y = spectra(12, seed=seed)
    rpm = np.resize(np.asarray(rpm, dtype=float), len(X))
    frequency = (np.arange(N_FREQUENCIES) + 0.5) / N_FREQUENCIES
    slope = np.where(y == "c", 2.0, 1.0) * np.log(rpm / 900)
    return X + slope[:, np.newaxis, np.newaxis] * frequency, y, rpm


def literal_covariances(X, y, rpm, smooth=0.3, rough=0.01, scaled=0.06):
    """Return S_w, and D without what several speeds teach."""
    rows = cosines(X).reshape(len(X), -1)
    own = [
        rows[(y == c) & (rpm == s)].mean(axis=0) for c, s in zip(y, rpm, strict=True)
    ]
    scatter = (rows - own).T @ (rows - own) / len(rows)
    overall = np.array([X[y == c].mean(axis=0) for c in np.unique(y)])
    moved = [[scaled_frequency(g[np.newaxis]) for g in each] for each in overall]
    shifts = np.concatenate([cosines(np.stack(each, axis=1)) for each in moved])
    shifts = shifts.reshape(len(shifts), -1)
    n = np.tile(np.arange(1, X.shape[-1]), X.shape[1])
    drift = np.diag(smooth / n**2 + rough) + scaled * shifts.T @ shifts / len(shifts)
    return scatter, drift


def literal_residual(X_train, y, rpm, row, speed=None, **drifts):
    """The docstring's formulas for one window, speed by speed and condition by condition."""
    classes, known = np.unique(y), np.unique(rpm)
    rows = cosines(X_train).reshape(len(X_train), -1)

    def mean(c, s):
        return rows[(y == c) & (rpm == s)].mean(axis=0)

    def reference(c, q, speeds):
        values = np.array([mean(c, s) for s in speeds])
        return np.array(
            [np.interp(np.log(q), np.log(speeds), each) for each in values.T]
        )

    def factor(q, speeds):
        below, above = speeds[speeds <= q], speeds[speeds >= q]
        if len(below) == 0 or len(above) == 0:
            return max(np.abs(np.log(q / speeds)).min() / 0.4, 0.2)
        parts = np.log(q / below.max()), np.log(above.min() / q)
        return max(parts[0] * parts[1] / max(sum(parts), 1e-300) / 0.4, 0.2)

    scatter, drift = literal_covariances(X_train, y, rpm, **drifts)
    if speed is None:
        speed, at_speed = known[0], 1.0
    else:
        at_speed = factor(speed, known)
        missed = []
        for s in known:
            others = known[known != s]
            for c in classes:
                e = mean(c, s) - reference(c, s, others)
                missed.append(e / np.sqrt(factor(s, others)))
        drift += np.mean([np.outer(e, e) for e in missed], axis=0)
    inverse = np.linalg.inv(scatter + at_speed * drift)
    here = cosines(row).ravel()
    differences = [here - reference(c, speed, known) for c in classes]
    return np.array([np.sqrt(d @ inverse @ d / len(d)) for d in differences])


@pytest.mark.parametrize("speed", [450.0, 600.0, 700.0, 1200.0, 2000.0])
def test_references_over_speed_are_the_formulas_of_the_docstring(speed):
    X, y, rpm = over_speeds([600, 900, 1200])
    row = over_speeds([speed], seed=1)[0][0]
    fitted = SpectralDistance().fit(X, y, rpm=rpm)
    expected = literal_residual(X, y, rpm, row, speed)
    assert_allclose(
        fitted.transform(row[np.newaxis], rpm=speed)[0], expected, rtol=1e-8
    )


def test_references_without_a_recording_are_interpolated_or_those_of_the_nearest_speed():
    X, y, rpm = over_speeds([600, 900, 1200])
    kept = (y == "a") | (rpm != np.where(y == "b", 1200, 900))
    fitted = SpectralDistance().fit(X[kept], y[kept], rpm=rpm[kept])
    _, b, c = fitted.references_.swapaxes(0, 1)
    share = np.log(900 / 600) / np.log(1200 / 600)
    assert_allclose(c[1], (1 - share) * c[0] + share * c[2])
    assert_array_equal(b[2], b[1])
    assert fitted.recorded_.tolist() == [[1, 1, 1], [1, 1, 0], [1, 0, 1]]


def test_a_stated_speed_helps_and_an_unknown_one_is_searched():
    X, y, rpm = over_speeds([600, 1200])
    fresh, truth, _ = over_speeds([850], seed=1)
    fitted = SpectralDistance().fit(X, y, rpm=rpm)
    own, index = np.unique(truth, return_inverse=True)[1], np.arange(len(fresh))
    stated = fitted.transform(fresh, rpm=850)
    assert np.mean(stated.argmin(axis=1) == own) > 0.95
    searched = fitted.transform(fresh)
    assert np.mean(searched.argmin(axis=1) == own) > 0.95
    # Without a speed the drift counts in full, as at a distance of .4 outside.
    pooled = SpectralDistance().fit(X, y).transform(fresh)
    assert searched[index, own].mean() < pooled[index, own].mean()


def test_speed_of_each_sample_counts_by_its_mean():
    X, y, rpm = over_speeds([600, 1200])
    fitted = SpectralDistance().fit(X, y, rpm=rpm)
    varying = 900 + np.linspace(-50, 50, 11) * np.ones((len(X), 1))
    assert_allclose(fitted.transform(X, rpm=varying), fitted.transform(X, rpm=900))


def test_a_speed_must_be_in_fit_and_above_zero():
    X, y = spectra(4)
    with pytest.raises(ValueError, match="rpm was given, but not in fit"):
        SpectralDistance().fit(X, y).transform(X, rpm=900)
    with pytest.raises(ValueError, match="expected revolutions per minute above 0"):
        SpectralDistance().fit(X, y, rpm=0)
