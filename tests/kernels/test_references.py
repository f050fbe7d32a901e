"""Kernels against slow references, on inputs that hypothesis draws, see `literal`."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from skarxlag.kernels import (
    arx_laguerre,
    cumulative_sum,
    laguerre,
    least_squares,
    linear_prediction,
    measures,
    observer,
    observer_bank,
    pole_search,
    residual_levels,
    running_median,
    scaling,
    short_time,
    spectra,
)
from skarxlag.kernels.lanes import LANES, TILE

from .literal import (
    generators,
    literal_bands,
    literal_cepstrum,
    literal_spectral_shape,
    many_examples,
    shares,
    some_examples,
    walk,
)
from .test_laguerre import cascade, impulse_responses
from .test_linear_prediction import literal_predictor
from .test_observer import literal_observer
from .test_observer_bank import POLE, STEP, literal_levels
from .test_pole_search import literal_cross_spectra


def assert_close(found, expected, tolerance=1e-9):
    """Equal up to a share of the largest expected size."""
    expected = np.asarray(expected)
    size = np.abs(expected).max(initial=0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * size + 1e-300)


# arx_laguerre, laguerre


@st.composite
def networks(draw, smallest=-0.9, largest=0.9):
    orders = draw(st.lists(st.integers(1, 9), min_size=1, max_size=3))
    poles = [draw(st.floats(smallest, largest)) for _ in orders]
    return np.array(orders), np.array(poles)


def states_by_filters(window, orders, poles):
    """States of all networks at each sample, by chains of filters."""
    parts = zip(orders, poles, window, strict=True)
    return np.concatenate([cascade(n, pole, signal) for n, pole, signal in parts])


@some_examples
@given(generators, networks(), st.integers(1, 5), st.integers(2, 60), shares)
def test_sums_of_products(rng, network, n_windows, n_samples, share):
    windows = rng.normal(size=(n_windows, len(network[0]), n_samples))
    weights, n_transient = rng.uniform(0, 3, n_windows), int(share * (n_samples - 1))
    n_states = network[0].sum()
    expected = np.zeros((n_states + 1, n_states + 1))
    for window, weight in zip(windows, weights, strict=True):
        states = states_by_filters(window, *network)
        for k in range(n_transient, n_samples):
            row = np.append(states[:, k], window[0, k])
            expected += weight * np.outer(row, row)
    parts = arx_laguerre.accumulate_sums(windows, weights, *network, n_transient)
    found = arx_laguerre.sums_of_products(*parts, *network)
    assert_close(np.tril(found), np.tril(expected))


@some_examples
@given(
    generators,
    networks(),
    st.integers(1, LANES + 3),
    st.integers(1, 5),
    st.integers(2, 2 * TILE + 5),
    shares,
)
def test_innovations(rng, network, n_windows, n_models, n_samples, share):
    windows = rng.normal(size=(n_windows, len(network[0]), n_samples))
    coef, n_transient = (
        rng.normal(size=(n_models, network[0].sum())),
        int(share * (n_samples - 1)),
    )
    found = np.empty((n_windows, n_models, n_samples - n_transient))
    arx_laguerre.innovations(windows, *network, coef, n_transient, found)
    states = [states_by_filters(window, *network) for window in windows]
    expected = [w[0] - coef @ x for w, x in zip(windows, states, strict=True)]
    assert_close(found, np.array(expected)[..., n_transient:])


@some_examples
@given(
    generators,
    networks(-0.7, 0.7),
    st.integers(1, 3),
    st.integers(2, 40),
    st.integers(0, 45),
)
def test_free_run(rng, network, n_windows, n_samples, n_start):
    orders, poles = network
    windows = rng.normal(size=(n_windows, len(orders), n_samples))
    coef = rng.normal(size=(2, orders.sum())) / orders.sum()
    found = arx_laguerre.free_run(windows, orders, poles, coef, n_start)
    # The states are convolutions with the responses to an impulse.
    parts = zip(orders, poles, strict=True)
    responses = [impulse_responses(n, pole, n_samples) for n, pole in parts]
    for w, window in enumerate(windows):
        for c, g in enumerate(coef):
            channels, simulated = window.copy(), []
            for k in range(n_samples):
                states = [
                    sum(response[:, k - j] * channel[j] for j in range(k))
                    + 0 * response[:, 0]
                    for response, channel in zip(responses, channels, strict=True)
                ]
                simulated.append(g @ np.concatenate(states))
                if k >= n_start:
                    channels[0, k] = simulated[k]
            assert_close(found[w, c], simulated)


@some_examples
@given(networks())
def test_state_space_of_networks(network):
    orders, poles = network
    A, B = laguerre.network_matrices(orders.tolist(), poles)
    ends = np.cumsum(orders)
    for channel, (order, pole) in enumerate(zip(orders, poles, strict=True)):
        own = slice(ends[channel] - order, ends[channel])
        single = laguerre.laguerre_matrices(order, pole)
        np.testing.assert_array_equal(A[own, own], single[0])
        np.testing.assert_array_equal(B[own, channel], single[1])
        assert not A[own, : own.start].any() and not A[own, own.stop :].any()
        assert not np.delete(B[own], channel, axis=1).any()
        response, state = impulse_responses(order, pole, 30), single[1]
        for k in range(1, 30):
            np.testing.assert_allclose(state, response[:, k], atol=1e-12)
            state = single[0] @ state


@some_examples
@given(st.integers(1, 70), st.floats(-0.97, 0.97))
def test_settling_length(order, pole):
    # The phase of one all-pass over a dense grid; it turns fastest at 0 or at pi.
    angle = np.linspace(0, np.pi, 20_001)
    phase = np.unwrap(
        np.angle((1 - pole * np.exp(1j * angle)) / (np.exp(1j * angle) - pole))
    )
    delay = order * np.max(-np.diff(phase) / np.diff(angle))
    assert abs(laguerre.settling_length(order, pole) - delay) < 1 + 1e-3 * delay


# running_median


@many_examples
@given(
    st.lists(st.integers(-5, 5), min_size=1, max_size=30),
    st.integers(0, 40),
    st.booleans(),
)
def test_running_median(values, half, mirrored):
    values, n = np.array(values, dtype=float), len(values)
    expected = []
    for i in range(n):
        around = []
        for k in range(i - half, i + half + 1):
            if mirrored:
                k %= 2 * n
                around.append(values[k] if k < n else values[2 * n - 1 - k])
            else:
                around.append(values[min(max(k, 0), n - 1)])
        expected.append(sorted(around)[half])
    beyond = "symmetric" if mirrored else "edge"
    found = running_median.running_median(values[np.newaxis], 2 * half + 1, beyond)
    np.testing.assert_array_equal(found[0], expected)


# cumulative_sum


def dense_run_length(limit, step, rate, persistence):
    """Mean run length from the chain of all states, written out as equations."""
    after_quiet = rate * (1 - persistence) / (1 - rate)
    states = [(total, exceeded) for total in range(limit) for exceeded in (False, True)]
    equations, ones = np.eye(len(states)), np.ones(len(states))
    for row, (total, exceeded) in enumerate(states):
        chance = persistence if exceeded else after_quiet
        for exceeds, probability in ((True, chance), (False, 1 - chance)):
            after = max(total + (step - 1 if exceeds else -1), 0)
            if after < limit:
                equations[row, states.index((after, exceeds))] -= probability
    return np.linalg.solve(equations, ones)[states.index((0, False))]


@some_examples
@given(
    st.integers(1, 25), st.integers(2, 9), st.floats(0.01, 0.4), st.floats(0.01, 0.9)
)
def test_mean_run_length(limit, step, rate, persistence):
    found = cumulative_sum.mean_run_length(limit, step, rate, persistence)
    expected = dense_run_length(limit, step, rate, persistence)
    # The equations are the worse conditioned, the longer the run.
    assert found == pytest.approx(expected, rel=1e-9 + 1e-15 * expected)


@some_examples
@given(
    st.floats(1, 1e4), st.integers(2, 6), st.floats(0.01, 0.14), st.floats(0.01, 0.5)
)
def test_alarm_limit(run_length, step, rate, persistence):
    found = cumulative_sum.alarm_limit(run_length, step, rate, persistence)
    assume(found <= 40)
    lengths = [
        dense_run_length(n, step, rate, persistence) for n in range(1, found + 1)
    ]
    assert all(length < run_length * (1 + 1e-7) for length in lengths[:-1])
    assert lengths[-1] >= run_length * (1 - 1e-7)


@many_examples
@given(st.floats(1e-4, 0.49), st.floats(1e-3, 0.999))
def test_reference_step(healthy, share):
    faulty = healthy + share * (0.999 - healthy)
    # The share of windows that exceed at which both rates are equally likely, by
    # bisection.
    low, high = healthy, faulty
    for _ in range(80):
        middle = (low + high) / 2
        gain = middle * math.log(faulty / healthy)
        gain += (1 - middle) * math.log((1 - faulty) / (1 - healthy))
        low, high = (middle, high) if gain < 0 else (low, middle)
    assume(abs(1 / low % 1 - 0.5) > 1e-6)
    nearest = math.floor(1 / low + 0.5)
    largest = max(m for m in range(1, 10_002) if m * healthy < 1)
    assert cumulative_sum.reference_step(healthy, faulty) == max(
        2, min(nearest, largest)
    )


# least_squares


@some_examples
@given(generators, st.integers(1, 6), st.integers(0, 12), st.floats(1e-3, 30))
def test_solution_of_sums(rng, n_states, n_rows, alpha):
    states, output = rng.normal(size=(n_rows, n_states)), rng.normal(size=n_rows)
    both = np.column_stack([states, output])
    coef, error = least_squares.solve_sums(both.T @ both, alpha)
    rows = np.concatenate([states, math.sqrt(alpha) * np.eye(n_states)])
    expected = np.linalg.lstsq(
        rows, np.concatenate([output, np.zeros(n_states)]), rcond=None
    )[0]
    np.testing.assert_allclose(coef, expected, atol=1e-8)
    assert error == pytest.approx(np.sum((output - states @ expected) ** 2), abs=1e-8)


@many_examples
@given(
    st.lists(
        st.lists(st.integers(0, 1), min_size=3, max_size=3), min_size=1, max_size=12
    ),
    st.data(),
)
def test_distinct_windows(samples, data):
    windows = np.array(samples, dtype=float)[:, np.newaxis]
    row = st.integers(0, len(samples) - 1)
    rows = data.draw(st.lists(row, min_size=1, max_size=15))
    weights = [data.draw(st.integers(1, 3)) for _ in rows]
    expected = {}
    for row, weight in zip(rows, weights, strict=True):
        expected[tuple(samples[row])] = expected.get(tuple(samples[row]), 0) + weight
    found = least_squares.distinct_windows(
        windows, np.array(rows), np.array(weights, dtype=float)
    )
    assert len(found[0]) == len(expected)
    assert expected == {
        tuple(samples[row]): weight for row, weight in zip(*found, strict=True)
    }


# linear_prediction


@some_examples
@given(generators, st.integers(1, 40), st.integers(0, 150), st.floats(-8, 1))
def test_predictors(rng, order, more, log_alpha):
    signals = rng.normal(size=(2, 3 * order + 2 + more)).cumsum(axis=1)
    signals[1] = rng.normal(size=signals.shape[1])
    alpha = 10**log_alpha
    for row, found in enumerate(linear_prediction.predictors(signals, order, alpha)):
        assert_close(found, literal_predictor(signals[row], order, alpha), 1e-6)


# observer, observer_bank, residual_levels


@st.composite
def loops(draw):
    """A loop that is stable at its smallest and at its largest gain."""
    difference, share = draw(st.floats(-0.7, 0.7)), draw(st.floats(0.05, 0.9))
    pole = draw(st.floats(-0.9, 0.9))
    saturation = draw(st.just(0.0) | st.floats(0, 2))
    exponent = draw(st.sampled_from([0.5, 1.0, 1.5]))
    gain = draw(st.floats(0.2, 3))
    ki = share * (1 - difference) / (gain * (1 + saturation**exponent))
    return (
        pole,
        pole - difference,
        ki,
        draw(st.floats(0, 1)),
        gain,
        exponent,
        saturation,
    )


@some_examples
@given(
    generators,
    loops(),
    st.integers(1, LANES + 2),
    st.integers(1, 2),
    st.integers(1, 2 * TILE + 5),
)
def test_observers(rng, loop, n_windows, n_models, n_samples):
    innovations = rng.normal(size=(n_windows, n_models, n_samples))
    error, estimate = observer.observe(innovations, loop)
    levels = residual_levels.power_levels(innovations, loop)
    for w in range(n_windows):
        for c in range(n_models):
            expected = literal_observer(innovations[w, c], *loop)
            assert_close(error[w, c], expected[0])
            assert_close(estimate[w, c], expected[1])
            power = math.fsum(e * e for e in expected[0]) / n_samples
            assert levels[w, c] == pytest.approx(math.sqrt(power), rel=1e-9)


@some_examples
@given(
    st.floats(-0.95, 0.95),
    st.floats(-0.95, 0.95),
    st.floats(0.01, 0.99),
    st.floats(1, 6),
)
def test_common_lyapunov(pole, difference, share, largest):
    kp, ki = pole - difference, share * 2 * (1 - difference) / largest
    slow, fast = (observer.loop_matrix(pole, kp, ki, gain) for gain in (1.0, largest))
    found = observer.common_lyapunov(slow, fast)
    radius = np.abs(np.linalg.eigvals([slow, fast])).max()
    assume(abs(radius - 1) > 1e-3 and abs(np.linalg.det(slow + np.eye(2))) > 1e-3)
    assume(abs(np.linalg.det(fast + np.eye(2))) > 1e-3)
    if radius > 1:
        assert found is None
        return
    # Cayley's transform makes both loops continuous in time, and they still differ by a
    # matrix of rank one. There is a common function if and only if their product has no
    # eigenvalue below 0 (Shorten and Narendra 2003).
    turned = [np.linalg.solve(A + np.eye(2), A - np.eye(2)) for A in (slow, fast)]
    product = turned[0] @ turned[1]
    discriminant = np.trace(product) ** 2 - 4 * np.linalg.det(product)
    assume(abs(discriminant) > 1e-2 * np.linalg.det(product))
    expected = not (discriminant > 0 and np.trace(product) < 0)
    assert (found is not None) == expected
    if found is not None:
        assert np.linalg.eigvalsh(found)[0] > 0
        for gain in np.linspace(1, largest, 9):
            A = observer.loop_matrix(pole, kp, ki, gain)
            assert np.linalg.eigvalsh(A.T @ found @ A - found)[-1] < 0


@some_examples
@given(
    generators,
    st.integers(1, 5),
    st.integers(1, 120),
    st.floats(0.7, 3),
    st.floats(0, 0.05),
)
def test_banks_of_observers(rng, n_members, n_samples, bandwidth, share):
    signals = rng.normal(size=(1, n_samples))
    kp, ki = observer_bank.member_gains(POLE, n_members, bandwidth)
    bound = share * ((1 - POLE + kp) / ki - 1)
    power, gain = observer_bank.bank_levels(signals, POLE, kp, ki, bound, STEP)
    unit = 2 * math.log(np.abs(signals).max())
    for m in range(n_members):
        # Where the poles are: two of the given angle, and of the radius of the
        # bandwidth.
        poles = np.roots([1, -(1 + POLE - kp[m]), POLE - kp[m] + ki[m]])
        radius = math.exp(-bandwidth * math.pi / (2 * n_members))
        angle = (m + 0.5) * math.pi / n_members
        expected = radius * np.exp(1j * angle * np.array([1, -1]))
        np.testing.assert_allclose(
            sorted(poles, key=np.imag), expected[::-1], atol=1e-6
        )
        levels = literal_levels(signals[0], kp[m], ki[m], bound[m])
        assert power[0, m] + unit == pytest.approx(levels[0], abs=2e-3)
        # Rounding may turn a vote, after which two gains stay two steps apart.
        assert gain[0, m] + unit == pytest.approx(levels[1], abs=4 * STEP)


@some_examples
@given(
    generators,
    st.integers(1, 4),
    st.integers(1, 60),
    st.floats(0, 20),
    st.floats(1e-3, 0.5),
)
def test_surfaces_and_switching_gains(rng, n_signals, n_samples, slope, step):
    error = rng.normal(size=(n_signals, n_samples))
    surface = residual_levels.sliding_surface(error, slope)
    gain = residual_levels.switching_gain(surface, step)
    level = residual_levels.settled_level(gain)
    for row in range(n_signals):
        before, expected = error[row, 0], []
        for e in error[row]:
            expected.append(slope * e + (e - before))
            before = e
        np.testing.assert_allclose(surface[row], expected, atol=1e-12)
        log_gain, path = 0.5 * math.log(max(np.mean(surface[row] ** 2), 1e-300)), []
        for s in surface[row]:
            log_gain += step * np.sign(math.log(max(abs(s), 1e-300)) - log_gain)
            path.append(log_gain)
        if np.any(surface[row]):
            # At equality, which one sample alone has, the step is a matter of rounding.
            if n_samples > 1:
                np.testing.assert_allclose(np.log(gain[row]), path, atol=1e-9)
            tail = [math.log(k) for k in gain[row][n_samples // 2 :]]
            assert math.log(level[row]) == pytest.approx(
                math.fsum(tail) / len(tail), abs=1e-9
            )


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 40), st.floats(0, 2))
def test_cepstral_norm(rng, n_signals, n_frequencies, exponent):
    log_spectra = walk(rng, n_signals, n_frequencies)
    expected = [
        math.fsum(
            n**exponent * d * d for n, d in enumerate(literal_cepstrum(row), start=1)
        )
        for row in log_spectra
    ]
    np.testing.assert_allclose(
        residual_levels.cepstral_norm(log_spectra, exponent), expected
    )


# pole_search


@some_examples
@given(generators, st.integers(1, 4), st.integers(1, 3), st.integers(1, 60))
def test_cross_spectra(rng, n_windows, n_channels, n_samples):
    windows = rng.normal(size=(n_windows, n_channels, n_samples))
    assert_close(pole_search.cross_spectra(windows), literal_cross_spectra(windows))


@some_examples
@given(generators, networks(-0.6, 0.6), st.floats(1e-6, 30))
def test_errors_of_poles(rng, network, alpha):
    orders, poles = np.minimum(network[0], 4), network[1]
    windows = rng.normal(size=(2, len(orders), 150))
    rows, outputs = [math.sqrt(alpha) * np.eye(orders.sum())], [np.zeros(orders.sum())]
    for window in np.pad(windows, ((0, 0), (0, 0), (0, 150))):
        rows.append(states_by_filters(window, orders, poles).T)
        outputs.append(window[0])
    rows, outputs = np.concatenate(rows), np.concatenate(outputs)
    coef = np.linalg.lstsq(rows, outputs, rcond=None)[0]
    expected = np.sum((outputs - rows @ coef) ** 2) / np.sum(outputs**2)
    both = pole_search.cross_spectra(windows)[np.newaxis]
    found = pole_search.fit_errors(both, orders.tolist(), poles.tolist(), alpha)
    np.testing.assert_allclose(found, [expected], rtol=1e-7)


@some_examples
@given(generators, st.integers(1, 5), st.floats(-0.9, 0.9))
def test_search_of_a_pole(rng, order, coefficient):
    signal = np.convolve(rng.normal(size=200), coefficient ** np.arange(200))[:200]
    spectrum = pole_search.cross_spectra(signal[np.newaxis, np.newaxis])[np.newaxis]
    (found,) = pole_search.search_poles(spectrum, [order], [None], 1e-6)
    tried = np.tanh(
        np.linspace(-1, 1, 301) * np.arctanh(min((200 - order) / (200 + order), 0.98))
    )
    least = min(
        pole_search.fit_errors(spectrum, [order], [pole], 1e-6)[0] for pole in tried
    )
    error = pole_search.fit_errors(spectrum, [order], [found], 1e-6)[0]
    assert error <= 1.01 * least


# scaling


def exact_mean(row):
    return sum(Fraction(float(x)) for x in row) / len(row)


windows_of_any_size = st.tuples(
    generators, st.floats(-250, 250), st.integers(2, 40)
).map(lambda drawn: (drawn[0].normal(size=(2, 3, drawn[2])) + 1) * 10.0 ** drawn[1])


@some_examples
@given(windows_of_any_size)
def test_scaling(windows):
    unit, peak = scaling.centred(windows)
    scaled, divisor = scaling.unit_rms_windows(windows)
    rms = scaling.root_mean_square(windows)
    for w, window in enumerate(windows):
        exact = [[Fraction(float(x)) - exact_mean(row) for x in row] for row in window]
        square = sum(x * x for x in exact[0]) / len(exact[0])
        # The root of a fraction of any size.
        size = max(abs(x) for x in exact[0])
        root = Fraction(math.sqrt(square / size**2)) * size
        assert divisor[w] == pytest.approx(float(root), rel=1e-12)
        for c, row in enumerate(window):
            largest = max(abs(Fraction(float(x))) for x in row)
            assert peak[w, c, 0] == float(largest)
            literal = [float(x / largest) for x in exact[c]]
            np.testing.assert_allclose(unit[w, c], literal, atol=1e-14)
            literal = np.array([float(x / root) for x in exact[c]])
            np.testing.assert_allclose(
                scaled[w, c], literal, atol=1e-12 * np.abs(literal).max()
            )
            mean = sum(Fraction(float(x)) ** 2 for x in row) / len(row) / largest**2
            assert rms[w, c] == pytest.approx(
                float(Fraction(math.sqrt(mean)) * largest), rel=1e-12
            )


@some_examples
@given(windows_of_any_size)
def test_fit_percentage(windows):
    for output, predicted, _ in windows:
        exact = [Fraction(float(x)) for x in output]
        mean = exact_mean(output)
        missed = sum(
            (y - Fraction(float(p))) ** 2 for y, p in zip(exact, predicted, strict=True)
        )
        ratio = math.sqrt(missed / sum((y - mean) ** 2 for y in exact))
        found = scaling.fit_percentage(output, predicted)
        assert found == pytest.approx(100 * (1 - ratio), rel=1e-9, abs=1e-7)


# short_time, spectra, measures


@some_examples
@given(generators, st.integers(1, 150), st.integers(1, 6))
def test_sorting(rng, n_rows, n_columns):
    rows = rng.integers(0, 9, size=(n_rows, n_columns)).astype(float)
    expected = np.array([sorted(column) for column in rows.T]).T
    short_time.sort_columns(rows.reshape(-1), n_columns)
    np.testing.assert_array_equal(rows, expected)


@some_examples
@given(
    generators,
    st.integers(1, 3),
    st.sampled_from([4, 7, 32, 128]),
    st.integers(1, 150),
    st.integers(0, 700),
)
def test_levels_of_bands(rng, n_signals, segment, hop, more):
    signals = rng.uniform(-1, 1, size=(n_signals, segment + more))
    window, floor = rng.uniform(0.1, 1, segment), rng.uniform(1e-6, 0.1, n_signals)
    found = short_time.band_levels(signals, window, hop, floor)
    for row in range(n_signals):
        power = []
        for start in range(0, more + 1, hop):
            transform = np.fft.fft(signals[row, start : start + segment] * window)
            power.append(np.abs(transform[1 : segment // 2]) ** 2 + floor[row])
        expected = np.mean(power, axis=0), np.median(power, axis=0)
        # Rounding in single precision is a share of the amplitude of the strongest
        # band.
        atol = 1e-6 * math.sqrt(np.max(power, initial=1.0))
        np.testing.assert_allclose(
            np.sqrt([level[row] for level in found]),
            np.sqrt(expected),
            rtol=1e-5,
            atol=atol,
        )


@some_examples
@given(generators, st.integers(1, 40), st.integers(1, 200), st.integers(1, 70))
def test_log_spectra_of_models(rng, order, n_samples, n_frequencies):
    signals = spectra.unit_peak(
        rng.normal(size=(2, n_samples)) * 10.0 ** rng.uniform(-9, 9)
    )
    np.testing.assert_allclose(np.abs(signals).max(axis=1), 1.0)
    found = spectra.autoregressive_log_spectrum(signals, order, n_frequencies)
    for row, signal in zip(found, signals, strict=True):
        np.testing.assert_allclose(
            row, literal_spectral_shape(signal, order, n_frequencies), atol=1e-4
        )
    grid = [(i + 0.5) * math.pi / n_frequencies for i in range(n_frequencies)]
    np.testing.assert_allclose(spectra.frequency_grid(n_frequencies), grid)


@some_examples
@given(
    generators,
    st.sampled_from([4, 9, 32, 128]),
    st.integers(1, 40),
    st.integers(0, 500),
)
def test_log_spectra_over_time(rng, segment, hop, more):
    signals = spectra.unit_peak(rng.normal(size=(2, segment + more)))
    found = spectra.short_time_log_spectra(signals, segment, hop)
    for row, signal in enumerate(signals):
        mean, median = literal_bands(signal, segment, hop)
        np.testing.assert_allclose(found[0, row], mean, atol=2e-3)
        np.testing.assert_allclose(found[1, row], median, atol=2e-3)


@some_examples
@given(
    generators,
    st.permutations(list(measures.MEASURES)),
    st.sampled_from([8, 32, 128]),
    st.integers(1, 20),
)
def test_measures(rng, names, segment, order):
    signals = 50 * rng.normal(size=(2, segment + 260))
    found = measures.measure(signals, names, segment, order)
    n_bands = segment // 2 - 1
    for row, signal in enumerate(signals):
        unit = signal / np.abs(signal).max()
        mean, median = literal_bands(unit, segment, max(segment // 8, 1))
        n_cells = math.ceil(252 / n_bands)
        fine = literal_spectral_shape(unit, order, n_bands * n_cells)
        spectral_shape = [
            fine[b * n_cells : (b + 1) * n_cells].mean() for b in range(n_bands)
        ]
        expected = {
            "power": mean,
            "floor": median,
            "steadiness": median - mean,
            "spectral_shape": spectral_shape,
        }
        for place, name in enumerate(names):
            np.testing.assert_allclose(found[row, place], expected[name], atol=4e-3)
