"""Every kernel against a slow reference of its own, on inputs that hypothesis draws.

The references are loops, explicit sums, dense matrices or exact fractions. They share
no code with the kernels. ``SKARXLAG_EXAMPLES=500 python -m pytest
tests/kernels/test_references.py`` tries more inputs, and other ones each time.
"""

import math
import os
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy import stats

from skarxlag.kernels import (
    arx_laguerre,
    comb,
    cumulative_sum,
    drift,
    fault_orders,
    healthy_limits,
    healthy_rows,
    ladder,
    laguerre,
    least_squares,
    linear_prediction,
    measures,
    observer,
    observer_bank,
    order_spectra,
    pole_search,
    residual_levels,
    running_median,
    scaling,
    short_time,
    spectra,
    speed_references,
)
from skarxlag.kernels.lanes import LANES, TILE

from .test_comb import literal_frequency
from .test_healthy_limits import literal_score, noise_rows
from .test_laguerre import cascade, impulse_responses
from .test_linear_prediction import literal_predictor
from .test_observer import literal_observer
from .test_observer_bank import POLE, STEP, literal_levels
from .test_order_spectra import literal_power
from .test_pole_search import literal_cross_spectra

EXAMPLES = os.environ.get("SKARXLAG_EXAMPLES")
some_examples = settings(
    max_examples=int(EXAMPLES or 15),
    derandomize=EXAMPLES is None,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
many_examples = settings(some_examples, max_examples=int(EXAMPLES or 60))
generators = st.integers(0, 2**32 - 1).map(np.random.default_rng)
shares = st.floats(0, 1)


def assert_close(found, expected, tolerance=1e-9):
    """Equal up to a share of the largest expected size."""
    expected = np.asarray(expected)
    size = np.abs(expected).max(initial=0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * size + 1e-300)


def between(x, places, values):
    """The value at x of the line through the neighbouring places; beyond the ends, the last one."""
    if x <= places[0]:
        return values[0]
    for i in range(1, len(places)):
        if x <= places[i]:
            share = (x - places[i - 1]) / (places[i] - places[i - 1])
            return (1 - share) * values[i - 1] + share * values[i]
    return values[-1]


def walk(rng, *shape):
    """Something that looks like a log spectrum."""
    return rng.normal(size=shape).cumsum(axis=-1) / 5


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


# comb


@some_examples
@given(
    generators,
    st.sampled_from([256, 500, 512]),
    st.integers(1, 4),
    st.floats(0.02, 0.08),
    st.floats(0, 0.1),
)
def test_comb_frequency(rng, n_samples, n_harmonics, fundamental, tolerance):
    # The reference knows nothing of what lies beyond the ends of the spectrum.
    assume((n_harmonics + 1) * fundamental * math.exp(tolerance) < 0.5)
    samples = rng.normal(size=n_samples)
    found = comb.comb_frequency(samples, fundamental, tolerance, n_harmonics)
    expected = literal_frequency(samples, fundamental, tolerance, n_harmonics)
    assert found == pytest.approx(expected, rel=1e-9)


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


# drift


@some_examples
@given(st.integers(1, 60), st.floats(0, 2), st.floats(0, 2))
def test_smooth_variance(n, smooth, rough):
    expected = [smooth / k / k + rough for k in range(1, n + 1)]
    np.testing.assert_allclose(drift.smooth_variance(n, smooth, rough), expected)


@some_examples
@given(generators, st.integers(1, 4), st.integers(2, 50))
def test_changes_of_log_spectra(rng, n_spectra, n_frequencies):
    log_spectra = walk(rng, n_spectra, n_frequencies)
    places = [f + 0.5 for f in range(n_frequencies)]
    scaled, raised = (
        drift.scaled_frequency(log_spectra),
        drift.raised_noise(log_spectra),
    )
    assert scaled.shape == raised.shape == (2 * n_spectra, n_frequencies)
    for i, row in enumerate(log_spectra):
        mean = sum(math.exp(level) for level in row) / n_frequencies
        for j, (factor, share) in enumerate(
            ((math.exp(0.1), 10**-2), (math.exp(-0.1), 10**-2.6))
        ):
            moved = [between(factor * x, places, row) for x in places]
            np.testing.assert_allclose(
                scaled[j * n_spectra + i], moved - row, atol=1e-12
            )
            added = [math.log(math.exp(level) + share * mean) for level in row]
            np.testing.assert_allclose(
                raised[j * n_spectra + i], added - row, atol=1e-12
            )


@some_examples
@given(generators, st.integers(1, 8), st.integers(0, 8))
def test_joint_axes(rng, n, rank):
    spread, root = rng.normal(size=(n, n)), rng.normal(size=(n, min(rank, n)))
    given_drift, scatter = spread @ spread.T + 0.1 * np.eye(n), root @ root.T
    axes, variances = drift.joint_axes(scatter, given_drift)
    np.testing.assert_allclose(axes.T @ given_drift @ axes, np.eye(n), atol=1e-8)
    np.testing.assert_allclose(axes.T @ scatter @ axes, np.diag(variances), atol=1e-8)
    plain = np.linalg.eigvals(np.linalg.solve(given_drift, scatter))
    np.testing.assert_allclose(variances, np.sort(plain.real).clip(0), atol=1e-8)


@some_examples
@given(
    generators,
    st.integers(1, 4),
    st.integers(1, 3),
    st.integers(1, 3),
    st.integers(0, 6),
    st.integers(1, 3),
)
def test_distances_along_axes(rng, n_rows, n_groups, n_classes, n_axes, n_tried):
    rows, axes = (
        rng.normal(size=(n_rows, n_groups, 5)),
        rng.normal(size=(n_groups, 5, n_axes)),
    )
    references = rng.normal(size=(3, n_classes, n_groups, n_axes))
    precisions = rng.uniform(0.1, 2, size=(3, n_groups, n_axes))
    places = rng.integers(0, 3, size=(n_tried, n_rows))
    along = drift.along_axes(rows, axes)
    found = drift.squared_distances(rows, axes, references, precisions, places)
    assert found.shape == (n_tried, n_rows, n_classes, n_groups)
    for w in range(n_rows):
        for g in range(n_groups):
            expected = [
                sum(rows[w, g, f] * axes[g, f, k] for f in range(5))
                for k in range(n_axes)
            ]
            np.testing.assert_allclose(along[w, g], expected, atol=1e-12)
            for tried, place in enumerate(places[:, w]):
                for c in range(n_classes):
                    squares = [
                        precisions[place, g, k]
                        * (expected[k] - references[place, c, g, k]) ** 2
                        for k in range(n_axes)
                    ]
                    mean = math.fsum(squares) / max(n_axes, 1)
                    assert found[tried, w, c, g] == pytest.approx(mean, rel=1e-9)


# fault_orders


@some_examples
@given(
    generators,
    st.lists(st.floats(0.3, 9), min_size=4, max_size=4),
    st.floats(0, 0.05),
    st.floats(0.002, 0.05),
    st.floats(0, 1),
)
def test_fault_comb(rng, orders, tolerance, slip, cage_weight):
    contrast = rng.exponential(size=4001)
    places = 0.01 * np.arange(4001)
    n_errors, n_slips = (math.floor(size / 0.002 + 1e-9) for size in (tolerance, slip))

    def heights(order, n_multiples):
        found = {}
        for shift in range(-n_errors - n_slips, n_errors + n_slips + 1):
            total = 0.0
            for k in range(1, n_multiples + 1):
                at = k * math.exp(0.002 * shift) * order
                below = int(at / 0.01)
                if at <= places[-1]:
                    near = slice(max(below - 2, 0), below + 3)
                    total += between(at, places[near], contrast[near])
            found[shift] = total / n_multiples
        return found

    def best(comb, error):
        return max(
            (
                comb[error + own] - 0.15 * (0.002 * own / slip) ** 2,
                -abs(own),
                error + own,
            )
            for own in range(-n_slips, n_slips + 1)
        )

    cage, spin, inner, outer = orders
    lines = (cage, 4), (spin, 4), (2 * spin, 3), (inner, 3), (outer, 3)
    combs = [heights(*line) for line in lines]
    fits = []
    for error in range(-n_errors, n_errors + 1):
        cage, spin, twice, inner, outer = (best(comb, error) for comb in combs)
        ball = (spin[0] + twice[0]) / 2 + cage_weight * min(cage[0], 1.0)
        expected = [ball, inner[0], outer[0]]
        shifts = [max(spin, twice)[2], inner[2], outer[2]]
        fit = sorted(expected)[1] - 0.6 * (0.002 * error / slip) ** 2
        fits.append((fit, -abs(error), expected, shifts))
    *_, expected, shifts = max(fits)
    scores, factors = fault_orders.fault_comb(
        contrast, np.array(orders), tolerance, slip, cage_weight
    )
    np.testing.assert_allclose(scores, expected, atol=1e-9)
    np.testing.assert_allclose(factors, np.exp(0.002 * np.array(shifts)), rtol=1e-12)


@some_examples
@given(
    generators,
    st.integers(1, 2),
    st.sampled_from([8, 25, 60, 100]),
    st.floats(0.01, 0.1),
)
def test_mean_contrast(rng, n_bands, n_values, step):
    envelopes = 1 + rng.exponential(size=(n_bands, n_values))
    n_fft, cell = 4 * n_values, 1 / (4 * n_values * step)
    k = np.arange(n_values)
    hann = np.sin(np.pi * (k + 1) / (n_values + 1)) ** 2
    n_cells = min(int(41 / cell) + 2, n_fft // 2 + 1)
    half = int(max(0.75, 12 / (n_values * step)) / cell / 2)
    curves = []
    for envelope in envelopes:
        centred = (envelope - envelope.mean()) * hann
        level = []
        for f in range(n_cells):
            power = abs(centred @ np.exp(-2j * np.pi * f * k / n_fft)) ** 2
            level.append(math.log(power + 1e-12 * np.mean(envelope**2) * n_values))
        above = []
        for f in range(n_cells):
            places = [
                min(max(j, 0), n_cells - 1) for j in range(f - half, f + half + 1)
            ]
            median = np.median([level[j] for j in places])
            above.append(max(level[f] - median + math.log(math.log(2)), 0))
        # The largest of three; beyond the ends there is nothing.
        curves.append([max(above[max(f - 1, 0) : f + 2]) for f in range(n_cells)])
    curve, highest = np.mean(curves, axis=0), cell * (n_cells - 1)
    orders = 0.01 * np.arange(4001)
    expected = [
        between(o, cell * np.arange(n_cells), curve) * (o <= highest)
        for o in orders[::37]
    ]
    at_the_end = np.abs(orders[::37] - highest) < 1e-9
    found = fault_orders.mean_contrast(envelopes, step)[::37]
    np.testing.assert_allclose(
        found[~at_the_end], np.array(expected)[~at_the_end], atol=1e-6
    )


# healthy_limits


@many_examples
@given(
    st.lists(st.integers(1, 400), min_size=1, max_size=4),
    st.randoms(use_true_random=False),
)
def test_blocks_of_time(numbers, random):
    at = [speed for speed, number in enumerate(numbers) for _ in range(number)]
    random.shuffle(at)
    found = healthy_limits.time_blocks(np.array(at))
    for speed, n_rows in enumerate(numbers):
        n_blocks = 5 if n_rows < 180 else n_rows // 30 if n_rows < 300 else 10
        own = [block for block, row in zip(found, at, strict=True) if row == speed]
        n_blocks = min(n_blocks, n_rows)
        assert own == [i * n_blocks // n_rows for i in range(n_rows)]


@many_examples
@given(st.lists(st.integers(1, 9), min_size=1, max_size=4), st.integers(1, 20))
def test_parts_of_rows(numbers, n_windows):
    at = np.repeat(np.arange(len(numbers)), numbers)
    enough = (n for n in range(1, n_windows + 1) if n * min(numbers) >= 5)
    assert healthy_limits.parts_of_rows(at, n_windows) == next(enough, n_windows)


@some_examples
@given(generators, st.integers(1, 4), st.floats(-5, 0))
def test_flagged_shares(rng, n_speeds, limit):
    at = rng.permutation(
        np.concatenate([np.arange(n_speeds), rng.integers(0, n_speeds, 20)])
    )
    logs, weights = (
        rng.integers(-5, 1, len(at)).astype(float),
        rng.uniform(0.1, 2, len(at)),
    )
    expected = []
    for speed in range(n_speeds):
        own = [i for i in range(len(at)) if at[i] == speed]
        flagged = math.fsum(weights[i] for i in own if logs[i] < limit)
        expected.append(flagged / math.fsum(weights[i] for i in own))
    found = healthy_limits.flagged_shares(logs, at, limit, weights)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@some_examples
@given(
    generators, st.integers(1, 3), st.floats(0.1, 9), st.booleans(), st.integers(2, 40)
)
def test_log_p_values(rng, n_speeds, scale, two_sided, n_blocks):
    n_features, n_rows = 4, 5
    known = np.sort(rng.uniform(0, 1, n_speeds))
    limits = healthy_limits.Limits(
        known,
        rng.normal(size=(n_features, n_features)),
        rng.uniform(0, 2, n_features),
        rng.normal(size=(n_speeds, n_features)),
        rng.normal(size=(n_speeds, 2)),
        np.column_stack([rng.normal(size=2), rng.uniform(0.1, 1, 2)]),
        rng.uniform(0.1, 1, 2),
        float(rng.normal()),
        float(rng.uniform(0.1, 1)),
        n_blocks,
    )
    cepstra, values = (
        rng.normal(size=(n_rows, 3, n_features)),
        rng.normal(size=(n_rows, 2)),
    )
    log_speed = rng.uniform(-0.5, 1.5, n_rows)
    rows = healthy_rows.Rows(
        np.zeros((n_rows, 1)), np.zeros((n_rows, 1)), cepstra, values
    )
    found = healthy_limits.log_p_values(
        limits, rows, log_speed, scale, two_sided=two_sided
    )
    more, freedom = 1 + 1 / n_blocks, min(n_blocks, 10) - 1
    for row, x in enumerate(log_speed):
        _, variance, beyond = literal_motion(x, known)
        moved = scale * math.sqrt(variance) + 0.09
        total = 0.0
        for k in range(n_features):
            place = cepstra[row].mean(axis=0) @ limits.axes[:, k]
            away = place - between(x, known, limits.references[:, k])
            total += away**2 / (limits.variances[k] + moved)
        score = math.log(total / n_features + 1e-3) - limits.score_mean
        tails = [stats.t.sf(score / limits.score_deviation / math.sqrt(more), freedom)]
        for j, per_distance in enumerate((0.4, 0.3)):
            slope, slope_variance = limits.slopes[j]
            expected = between(x, known, limits.means[:, j]) + slope * beyond
            spread = limits.deviations[j] ** 2 * more + moved * per_distance**2
            spread += scale * slope_variance * beyond**2
            z = (values[row, j] - expected) / math.sqrt(spread)
            both = two_sided or j == 1
            tails.append(
                2 * stats.t.sf(abs(z), freedom) if both else stats.t.sf(z, freedom)
            )
        assert found[row] == pytest.approx(min(math.log(3 * min(tails)), 0), abs=1e-7)


# healthy_rows


def literal_cepstrum(log_spectrum):
    """Cosine coefficients from 1 on, as explicit sums."""
    n = len(log_spectrum)
    angles = [(i + 0.5) * math.pi / n for i in range(n)]
    return [
        2
        / n
        * math.fsum(
            v * math.cos(c * a) for v, a in zip(log_spectrum, angles, strict=True)
        )
        for c in range(1, n)
    ]


def literal_colour(samples, order, n_frequencies):
    """Log spectrum of the model that plain ridge regression finds."""
    order = min(order, len(samples) // 8)
    if order == 0 or not np.any(samples):
        return np.zeros(n_frequencies)
    g = literal_predictor(samples, order, 1e-9)
    found = []
    for cell in range(n_frequencies):
        omega = (cell + 0.5) * math.pi / n_frequencies
        response = 1 - g @ np.exp(-1j * omega * np.arange(1, order + 1))
        found.append(-math.log(abs(response) ** 2))
    return np.array(found)


def literal_bands(samples, segment, hop):
    """Log mean and log median power of the bands of segments."""
    k = np.arange(segment)
    hann = np.sin(np.pi * (k + 1) / (segment + 1)) ** 2
    floor = 1e-12 * segment * np.mean(samples**2) or 1.0
    power = []
    for start in range(0, len(samples) - segment + 1, hop):
        windowed = samples[start : start + segment] * hann
        sums = [
            windowed @ np.exp(-2j * np.pi * f * k / segment)
            for f in range(1, segment // 2)
        ]
        power.append(np.abs(sums) ** 2 + floor)
    return np.log(np.mean(power, axis=0)), np.log(np.median(power, axis=0))


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 70), st.integers(2, 40))
def test_features_of_log_spectra(rng, n_rows, n_frequencies, n_bands):
    spectral_shape, steadiness = (
        walk(rng, n_rows, n_frequencies),
        walk(rng, n_rows, n_bands),
    )
    expected = [
        literal_cepstrum(c)[:48] + literal_cepstrum(s)
        for c, s in zip(spectral_shape, steadiness, strict=True)
    ]
    found = healthy_rows.log_spectra_cepstra(spectral_shape, steadiness)
    np.testing.assert_allclose(found, expected, atol=1e-10)
    np.testing.assert_allclose(
        spectra.cepstrum(steadiness), [e[-n_bands + 1 :] for e in expected]
    )
    unsteady = [
        math.log(max(-math.fsum(row) / n_bands - 0.36, 0) + 0.02) for row in steadiness
    ]
    np.testing.assert_allclose(
        healthy_rows.log_unsteadiness(steadiness), unsteady, atol=1e-9
    )


@some_examples
@given(
    generators,
    st.integers(1, 3),
    st.integers(40, 300),
    st.integers(0, 2),
    st.booleans(),
)
def test_features_of_rows(rng, n_windows, length, left_over, with_level):
    signals = 3 + rng.normal(
        size=(2, n_windows * length + min(left_over, n_windows - 1))
    )
    found = healthy_rows.measure_rows(signals, n_windows, with_level=with_level)
    assert found.cepstra.shape[2] == healthy_rows.number_of_cepstra(length)
    for row, signal in enumerate(signals[:, : n_windows * length]):
        centred = signal - signal.mean()
        windows = [w / np.abs(w).max() for w in np.split(centred, n_windows)]
        colours = [literal_colour(w, 128, 256) for w in windows]
        segment = min(128, length)
        bands = [literal_bands(w, segment, min(16, segment)) for w in windows]
        steady = [median - mean for mean, median in bands]
        np.testing.assert_allclose(
            found.spectral_shape[row], np.mean(colours, axis=0), atol=1e-5
        )
        np.testing.assert_allclose(
            found.steadiness[row], np.mean(steady, axis=0), atol=1e-3
        )
        for w in range(n_windows):
            expected = literal_cepstrum(colours[w])[:48] + literal_cepstrum(steady[w])
            np.testing.assert_allclose(found.cepstra[row, w], expected, atol=1e-3)
        values = [math.log(max(-np.mean(steady) - 0.36, 0) + 0.02)]
        values += [math.log(math.sqrt(np.mean(centred**2)))] * with_level
        np.testing.assert_allclose(found.values[row], values, atol=1e-2)


# ladder

levels_and_numbers = st.lists(
    st.tuples(st.integers(0, 30).map(float), st.integers(1, 3)), min_size=1, max_size=30
)


@many_examples
@given(levels_and_numbers, st.integers(1, 99))
def test_thresholds(rows, percent):
    levels, numbers = (np.array(column) for column in zip(*rows, strict=True))
    repeated = sorted(level for level, number in rows for _ in range(number))
    rank = math.ceil((len(repeated) + 1) * (1 - Fraction(percent, 100)))
    expected = repeated[min(rank, len(repeated)) - 1]
    found = ladder.false_alarm_threshold(levels, numbers.astype(float), percent / 100)
    assert found == expected
    assert ladder.weighted_median(levels, numbers.astype(float)) == np.median(repeated)


@many_examples
@given(st.integers(1, 999))
def test_rows_that_hold(per_mille):
    enough = (
        n for n in range(1, 1000) if Fraction(1, n + 1) <= Fraction(per_mille, 1000)
    )
    assert ladder.rows_that_hold(per_mille / 1000) == next(enough)


@many_examples
@given(
    st.lists(st.floats(1e-30, 1e30) | st.just(0.0), min_size=1, max_size=9),
    st.lists(st.floats(1e-20, 1e20), min_size=0, max_size=4).map(sorted),
)
def test_scores_of_rungs(levels, cuts):
    # A cut itself belongs to the rung below it.
    levels = levels + cuts
    found = ladder.rung_scores(np.array(levels), np.array(cuts))
    for level, scores in zip(levels, found, strict=True):
        bounds = [-746.0, *map(math.log, cuts), 745.0]
        log = math.log(level) if level > 0 else -745.0
        expected = [min(log - low, high - log) for low, high in pairwise(bounds)]
        np.testing.assert_allclose(scores, expected, atol=1e-8)
        near = any(0 < abs(log - bound) < 1e-6 for bound in bounds)
        # Logarithms of neighbouring numbers are equal.
        are_apart = all(high - low > 1e-6 for low, high in pairwise(bounds))
        if not near and are_apart:
            assert scores.argmax() == sum(level > cut for cut in cuts)


@some_examples
@given(
    st.lists(
        st.lists(st.floats(1e-50, 1e50), min_size=3, max_size=3), min_size=1, max_size=5
    )
)
def test_scores_relative_to_the_geometric_mean(levels):
    found = ladder.relative_scores(np.array(levels))
    for row, scores in zip(levels, found, strict=True):
        mean = math.fsum(math.log(level) for level in row) / 3
        np.testing.assert_allclose(scores, [mean - math.log(v) for v in row], atol=1e-9)


@some_examples
@given(generators, st.integers(2, 4), st.floats(-2, 2))
def test_confidence_scale(rng, n_classes, log_size):
    scores, target = rng.normal(size=(30, n_classes)), rng.integers(0, n_classes, 30)
    scores[np.arange(30), target] += 0.5
    scores *= math.exp(log_size)
    numbers = rng.integers(1, 4, 30)
    counts = [int(numbers[target == c].sum()) for c in range(n_classes)]

    def loss(log_factor):
        total = 0.0
        for row, true, number in zip(scores, target, numbers, strict=True):
            powers = np.exp(math.exp(log_factor) * (row - row.max()))
            logs = np.log(np.maximum(powers / powers.sum(), 1e-300))
            sure = (counts[true] + 1) / (counts[true] + 2)
            for c in range(n_classes):
                total -= (
                    number
                    * logs[c]
                    * (sure if c == true else (1 - sure) / (n_classes - 1))
                )
        return total

    found = math.log(ladder.confidence_scale(scores, target, numbers.astype(float)))
    assert loss(found) <= min(loss(log) for log in np.arange(-10, 4, 0.25)) + 1e-4


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


# order_spectra


@some_examples
@given(
    generators,
    st.integers(40, 200),
    st.integers(4, 40),
    st.integers(1, 40),
    st.integers(1, 5),
)
def test_envelopes_of_bands(rng, n_samples, frame, hop, n_bands):
    samples = rng.normal(size=n_samples).cumsum()
    found = order_spectra.band_envelopes(samples, frame, hop, n_bands)
    centred, k = samples - samples.mean(), np.arange(frame)
    hann = np.sin(np.pi * (k + 1) / (frame + 1)) ** 2
    starts, frequencies = (
        range(0, n_samples - frame + 1, hop),
        range(1, max(frame // 2, 2)),
    )
    power = np.array(
        [
            [
                abs(centred[s : s + frame] * hann @ np.exp(-2j * np.pi * f * k / frame))
                ** 2
                for f in frequencies
            ]
            for s in starts
        ]
    )
    share = power / (power.mean(axis=0) + 1e-14 * frame * np.mean(centred**2))
    # The first bands get the frequencies that remain.
    sizes = [
        len(frequencies) // n_bands + (b < len(frequencies) % n_bands)
        for b in range(n_bands)
    ]
    ends = np.cumsum(sizes)
    for b, (size, end) in enumerate(zip(sizes, ends, strict=True)):
        expected = share[:, end - size : end].sum(axis=1) / max(size, 1)
        np.testing.assert_allclose(found[b], expected, rtol=1e-6, atol=1e-12)


@some_examples
@given(generators, st.integers(2, 120), st.floats(0.01, 2), shares)
def test_order_spectra(rng, n_values, step, share):
    envelopes = 1 + rng.exponential(size=(2, n_values))
    n_segment = 2 + int(share * (n_values - 2))
    log_power, cell = order_spectra.order_spectrum(envelopes, step, n_segment * step)
    k = np.arange(n_segment)
    window = np.sin(np.pi * (k + 1) / (n_segment + 1)) ** 2
    last = log_power.shape[1] - 1
    assert cell * last == pytest.approx(0.5 / step) and last >= 2 * n_segment
    for band in range(2):
        for place in (0, 1, last // 3, last - 1, last):
            power = literal_power(envelopes[band], n_segment, 0.5 * place / last)
            power *= (1 if place in (0, last) else 2) / np.sum(window**2)
            assert log_power[band, place] == pytest.approx(
                math.log(power + 1e-9), abs=1e-6
            )


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 50), st.floats(0.05, 0.5))
def test_spectra_at_orders_and_their_distances(rng, n_bands, n_frequencies, step):
    log_power = walk(rng, n_bands, n_frequencies)
    orders, factors = np.sort(rng.uniform(0.1, 10, 8)), rng.uniform(0.5, 2, 3)
    references, variances = (
        rng.normal(size=(2, n_bands, 8)),
        rng.uniform(0.5, 2, (n_bands, 8)),
    )
    found, inside = order_spectra.at_orders(log_power, step, orders, factors)
    distances = order_spectra.distances(found, inside, references, variances)
    for f, factor in enumerate(factors):
        shown = [o for o in range(8) if factor * orders[o] / step <= n_frequencies - 1]
        assert np.flatnonzero(inside[f]).tolist() == shown
        squares = np.zeros(2)
        for band in range(n_bands):
            values = [
                between(
                    factor * orders[o] / step, range(n_frequencies), log_power[band]
                )
                for o in shown
            ]
            expected = np.zeros(8)
            if shown:
                expected[shown] = values - np.median(values)
            np.testing.assert_allclose(found[f, band], expected, atol=1e-9)
            for o in shown:
                squares += (expected[o] - references[:, band, o]) ** 2 / variances[
                    band, o
                ]
        literal = np.sqrt(squares / (len(shown) * n_bands)) if shown else np.ones(2)
        np.testing.assert_allclose(distances[f], literal, rtol=1e-7)


@some_examples
@given(generators, st.integers(2, 12), st.integers(1, 12))
def test_equal_angles(rng, n_frames, hop):
    frame = 2 * hop
    turn = rng.uniform(20, 40, size=(n_frames - 1) * hop + frame)
    envelopes = rng.exponential(size=(2, n_frames))
    found, step = order_spectra.equal_angles(envelopes, turn, frame, hop)
    angle = [math.fsum(1 / turn[: k + 1]) for k in range(len(turn))]
    centres = [i * hop + (frame - 1) / 2 for i in range(n_frames)]
    at = [between(centre, range(len(turn)), angle) for centre in centres]
    assert step == pytest.approx((at[-1] - at[0]) / (n_frames - 1))
    for i in range(n_frames):
        place = at[0] + i * (at[-1] - at[0]) / (n_frames - 1)
        expected = [between(place, at, envelope) for envelope in envelopes]
        np.testing.assert_allclose(found[:, i], expected, atol=1e-9)


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
            row, literal_colour(signal, order, n_frequencies), atol=1e-4
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
        fine = literal_colour(unit, order, n_bands * n_cells)
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


# speed_references


def literal_motion(x, known):
    """Weights of known values, variance in unit distances, and distance beyond, one by one."""
    weights = np.zeros(len(known))
    if x <= known[0]:
        weights[0] = 1
        return weights, (known[0] - x) / math.log(1.3), x - known[0]
    if x >= known[-1]:
        weights[-1] = 1
        return weights, (x - known[-1]) / math.log(1.3), x - known[-1]
    i = next(i for i in range(len(known)) if known[i] > x)
    below, above = x - known[i - 1], known[i] - x
    weights[i - 1], weights[i] = above / (below + above), below / (below + above)
    # Two resistors in parallel: the precision of either side adds up.
    return (
        weights,
        1 / (1 / below + 1 / above) / math.log(1.3) if below > 0 else 0.0,
        0.0,
    )


known_speeds = st.lists(st.integers(1, 60), min_size=1, max_size=5, unique=True).map(
    lambda numbers: 0.03 * np.sort(numbers)
)


@many_examples
@given(generators, known_speeds, st.lists(st.floats(-1, 3), min_size=1, max_size=5))
def test_speeds_beside_known_ones(rng, known, places):
    values = rng.normal(size=(len(known), 2))
    at = speed_references.speed_distance(np.array(places), known)
    interpolated = at.interpolate(values)
    factors = speed_references.drift_factor(at.variance)
    for row, x in enumerate(places):
        weights, variance, beyond = literal_motion(x, known)
        np.testing.assert_allclose(interpolated[row], weights @ values, atol=1e-9)
        assert at.variance[row] == pytest.approx(variance, abs=1e-9)
        assert at.beyond[row] == pytest.approx(beyond, abs=1e-12)
        assert factors[row] == pytest.approx(max(variance * math.log(1.3) / 0.4, 0.2))


@many_examples
@given(st.lists(st.integers(0, 40), min_size=1, max_size=25))
def test_groups_of_speeds(numbers):
    # In steps of 0.7 % no two speeds differ by exactly 2 %.
    log_speed = [0.007 * n for n in numbers]
    groups = []
    for value in sorted(log_speed):
        if groups and value - groups[-1][0] <= 0.02:
            groups[-1].append(value)
        else:
            groups.append([value])
    known, at = speed_references.group_speeds(np.array(log_speed))
    np.testing.assert_allclose(
        known, [math.fsum(g) / len(g) for g in groups], atol=1e-12
    )
    assert all(
        value in groups[place] for value, place in zip(log_speed, at, strict=True)
    )
    middles = []
    for value, after in pairwise(known):
        middles += [value, (value + after) / 2]
    np.testing.assert_allclose(
        speed_references.speeds_to_try(known), [*middles, known[-1]]
    )


@some_examples
@given(generators, st.integers(1, 3), st.integers(1, 3), st.integers(0, 12))
def test_means_of_groups(rng, n_speeds, n_groups, more):
    n = max(n_speeds, n_groups)
    speed = np.concatenate([np.arange(n) % n_speeds, rng.integers(0, n_speeds, more)])
    group = np.concatenate([np.arange(n) % n_groups, rng.integers(0, n_groups, more)])
    values, numbers = rng.normal(size=(len(speed), 2)), rng.integers(1, 4, len(speed))
    means, recorded = speed_references.mean_by_speed(
        values, speed, group, numbers.astype(float)
    )
    plain = speed_references.group_means(values, group, numbers.astype(float))
    for g in range(n_groups):
        chosen = [
            values[i]
            for i in range(len(speed))
            if group[i] == g
            for _ in range(numbers[i])
        ]
        np.testing.assert_allclose(plain[g], np.mean(chosen, axis=0), atol=1e-12)
        for s in range(n_speeds):
            own = [i for i in range(len(speed)) if group[i] == g and speed[i] == s]
            assert recorded[s, g] == bool(own)
            chosen = [values[i] for i in own for _ in range(numbers[i])] or [
                np.zeros(2)
            ]
            np.testing.assert_allclose(means[s, g], np.mean(chosen, axis=0), atol=1e-12)


@some_examples
@given(generators, known_speeds, st.integers(1, 3))
def test_references_at_speeds(rng, known, n_conditions):
    recorded = rng.random((len(known), n_conditions)) < 0.6
    recorded[rng.integers(0, len(known), n_conditions), np.arange(n_conditions)] = True
    log_speed = rng.uniform(-0.5, 2.5, 4)
    weights, variance = speed_references.reference_weights(log_speed, known, recorded)
    means = rng.normal(size=(len(known), n_conditions))
    learned = []
    for place, x in enumerate(known):
        for c in range(n_conditions):
            rest = [i for i in range(len(known)) if recorded[i, c] and i != place]
            if recorded[place, c] and rest:
                by, moved, _ = literal_motion(x, known[rest])
                scale = math.sqrt(max(moved * math.log(1.3) / 0.4, 0.2))
                learned.append((means[place, c] - by @ means[rest, c]) / scale)
    found = speed_references.drift_learned(known, means, recorded)
    np.testing.assert_allclose(found, learned, atol=1e-9)
    for row, x in enumerate(log_speed):
        widest = 0.0
        for c in range(n_conditions):
            own = np.flatnonzero(recorded[:, c])
            by, moved, _ = literal_motion(x, known[own])
            expected = np.zeros(len(known))
            expected[own] = by
            np.testing.assert_allclose(weights[row, :, c], expected, atol=1e-9)
            widest = max(widest, moved)
        assert variance[row] == pytest.approx(widest, abs=1e-9)


@some_examples
@given(generators, known_speeds, st.floats(-2, 2), st.floats(0.1, 2), st.floats(0.1, 2))
def test_slopes_against_speed(rng, known, mean, deviation, drift):
    values = rng.normal(size=len(known))
    # Increments are independent: a regression of them on their distances, with the
    # prior as a row.
    rows, targets = [1 / deviation], [mean / deviation]
    for i in range(1, len(known)):
        noise = drift * math.sqrt((known[i] - known[i - 1]) / math.log(1.3))
        rows.append((known[i] - known[i - 1]) / noise)
        targets.append((values[i] - values[i - 1]) / noise)
    precision = math.fsum(r * r for r in rows)
    slope, variance = speed_references.slope_against_speed(
        values, known, mean=mean, deviation=deviation, drift=drift
    )
    assert slope == pytest.approx(np.dot(rows, targets) / precision, abs=1e-9)
    assert variance == pytest.approx(1 / precision)


# fault_orders, order_spectra and drift: what is put together from several kernels


def literal_squared_envelope(samples, n_fft, first, last, prewhiten):
    """Squared size of the sum of all frequencies of a band, one sample after another."""
    k, centred = np.arange(len(samples)), samples - samples.mean()
    total = np.zeros(len(samples), dtype=complex)
    for f in range(n_fft // 2 + 1):
        turning = np.exp(2j * np.pi * f * k / n_fft)
        amplitude = centred @ turning.conj()
        if first <= Fraction(f, n_fft) <= last:
            # The mean, which has been taken off, is nothing but rounding.
            size = abs(amplitude) if prewhiten and f > 0 else 1.0
            total += amplitude / size * turning / n_fft
    return np.abs(total) ** 2


@some_examples
@given(
    generators,
    st.integers(16, 120),
    st.integers(0, 20).map(lambda percent: Fraction(percent, 100)),
    st.integers(25, 50).map(lambda percent: Fraction(percent, 100)),
    st.booleans(),
)
def test_squared_envelope_spectrum(rng, n, first, last, prewhiten):
    # A limit that is a frequency, which only a fraction meets, is a matter of rounding.
    first, last = first + Fraction(1, 10_007), last - Fraction(1, 10_007)
    samples = 5 + rng.normal(size=n)
    squared = literal_squared_envelope(samples, n, first, last, prewhiten)
    k = np.arange(n)
    windowed = (squared / squared.mean() - 1) * np.sin(np.pi * (k + 1) / (n + 1)) ** 2
    expected = [
        abs(windowed @ np.exp(-2j * np.pi * f * k / n)) ** 2 * 16 / n**2
        for f in range(n // 2 + 1)
    ]
    band = (float(first), float(last))
    found = fault_orders.squared_envelope_spectrum(samples, band, prewhiten)
    np.testing.assert_allclose(found, expected, atol=1e-9)


@some_examples
@given(generators, st.sampled_from([64, 90, 120]), st.floats(50, 900))
def test_prewhitened_envelope(rng, n, turn):
    samples = 5 + rng.normal(size=n)
    squared = literal_squared_envelope(samples, n, 0, Fraction(1, 2), True)
    block = max(int(turn / 100), 1)
    expected = [np.mean(squared[i : i + block]) for i in range(0, n - block + 1, block)]
    # Prewhitened samples have no size of their own.
    found, step = fault_orders.prewhitened_envelope(samples, turn)
    assert step == pytest.approx(block / turn)
    np.testing.assert_allclose(
        found[0] / found.mean(), expected / np.mean(expected), rtol=1e-7
    )


@some_examples
@given(generators, st.integers(10, 60), st.floats(0, 0.3))
def test_match(rng, n_values, deviation):
    envelopes, step = 1 + rng.exponential(size=(2, n_values)), 0.05
    orders, n_turns = np.linspace(0.5, 6, 12), n_values * step / 2
    references, variances = rng.normal(size=(3, 2, 12)), rng.uniform(0.5, 2, (2, 12))
    least, factors, closest = order_spectra.match(
        envelopes, step, n_turns, orders, deviation, references, variances
    )
    # Groups of factors, each as wide as 0.4 at most, with steps of 0.02 from its
    # middle.
    n_groups = next(n for n in range(1, 9) if 4 * deviation / n <= 0.4 + 1e-9)
    tried = []
    for group in range(n_groups):
        centre = 2 * deviation * ((2 * group + 1) / n_groups - 1)
        log_power, cell = order_spectra.order_spectrum(
            envelopes, step * math.exp(centre), n_turns
        )
        n_steps = math.floor(2 * deviation / n_groups / 0.02 + 1e-9)
        for number in range(-n_steps, n_steps + 1):
            near = np.array([math.exp(0.02 * number)])
            spectra_, inside = order_spectra.at_orders(log_power, cell, orders, near)
            away = order_spectra.distances(spectra_, inside, references, variances)[0]
            log = centre + 0.02 * number
            unlikely = (log / deviation) ** 2 / 50 if deviation > 0 else 0.0
            tried.append((np.sqrt(away**2 + unlikely), math.exp(log), spectra_[0]))
    for c in range(3):
        residual, factor, spectrum = min(tried, key=lambda each: each[0][c])
        assert least[c] == pytest.approx(residual[c])
        assert factors[c] == pytest.approx(factor)
        np.testing.assert_allclose(closest[c], spectrum)


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 60), st.integers(2, 20))
def test_covariance_of_drift(rng, n_speeds, n_frequencies, n_bands):
    spectral_shape, steadiness = (
        walk(rng, n_speeds, n_frequencies),
        walk(rng, n_speeds, n_bands),
    )
    n_colour = min(48, n_frequencies - 1)
    numbers = [*range(1, n_colour + 1), *range(1, n_bands)]
    expected = np.diag([0.1 / n**2 + 0.01 for n in numbers])

    def moved(row, factor):
        places = [f + 0.5 for f in range(len(row))]
        return [
            between(factor * x, places, row) - y
            for x, y in zip(places, row, strict=True)
        ]

    for c, s in zip(spectral_shape, steadiness, strict=True):
        for shift in (0.1, -0.1):
            both = [literal_cepstrum(moved(row, math.exp(shift))) for row in (c, s)]
            change = [*both[0][:48], *both[1]]
            expected += 0.1 * np.outer(change, change) / (2 * n_speeds)
        for share in (10**-2, 10**-2.6):
            raised = np.log(np.exp(c) + share * np.mean(np.exp(c))) - c
            change = [*literal_cepstrum(raised)[:48], *[0.0] * (n_bands - 1)]
            expected += 0.5 * np.outer(change, change) / (2 * n_speeds)
    np.testing.assert_allclose(
        drift.drift_covariance(spectral_shape, steadiness), expected, atol=1e-9
    )


# healthy_limits as a whole


@st.composite
def healthy_recordings(draw, fewest):
    """Rows of noise at some speeds, in any order of speeds, with weights."""
    numbers = draw(st.lists(st.integers(3, 8), min_size=fewest, max_size=3))
    at = np.array(
        draw(st.permutations(np.repeat(np.arange(len(numbers)), numbers).tolist()))
    )
    rng = draw(generators)
    rows = noise_rows(
        len(at), seed=int(rng.integers(1000)), n_windows=draw(st.integers(1, 2))
    )
    rows.values[:] += rng.normal(size=(len(numbers), 1))[at]
    known = np.log(1000.0) + np.cumsum(rng.uniform(0.05, 0.5, len(numbers)))
    return healthy_limits.HealthyRows(rows, known, at, rng.uniform(0.5, 3, len(at)))


@some_examples
@given(healthy_recordings(1))
def test_calibration_on_blocks_of_time(healthy):
    rows, _, at, weights = healthy
    block = np.zeros(len(at), dtype=int)
    for speed in range(at.max() + 1):
        own = np.flatnonzero(at == speed)
        block[own] = [i * min(5, len(own)) // len(own) for i in range(len(own))]
    scores, squares = [], []
    for number in range(block.max() + 1):
        speeds = set(at[block == number])
        rest = np.array(
            [i for i in range(len(at)) if block[i] != number and at[i] in speeds]
        )
        for speed in speeds:
            here = np.flatnonzero((block == number) & (at == speed))
            others = rest[at[rest] == speed]
            scores.append((literal_score(rows, here, rest, at, weights), weights[here]))
            mean = np.average(rows.values[others], axis=0, weights=weights[others])
            square = (rows.values[here] - mean) ** 2
            squares.append(np.average(square, axis=0, weights=weights[here]))
    limits = healthy_limits.calibrate(healthy)
    n, mean = len(scores), np.mean([np.average(s, weights=w) for s, w in scores])
    spread = sum(np.average((score - mean) ** 2, weights=w) for score, w in scores) / (
        n - 1
    )
    assert limits.n_blocks == n
    assert limits.score_mean == pytest.approx(mean, abs=1e-6)
    assert limits.score_deviation == pytest.approx(
        max(math.sqrt(spread), 0.05), rel=1e-6
    )
    expected = np.maximum(np.sqrt(np.sum(squares, axis=0) / (n - 1)), 0.02)
    np.testing.assert_allclose(limits.deviations, expected)


@pytest.mark.slow
@some_examples
@given(healthy_recordings(2))
def test_scale_of_the_drift(healthy):
    rows, known, at, weights = healthy
    limits = healthy_limits.calibrate(healthy)
    measured = ("deviations", "score_mean", "score_deviation", "n_blocks")

    def logs_of(scale):
        logs = np.empty(len(at))
        for speed in range(len(known)):
            own, rest = np.flatnonzero(at == speed), np.flatnonzero(at != speed)
            others = healthy_limits.calibrate(healthy.take(rest))
            others = others._replace(
                **{name: getattr(limits, name) for name in measured}
            )
            logs[own] = healthy_limits.log_p_values(
                others, rows.take(own), known[at[own]], scale
            )
        return logs

    expected = 64.0
    for half_steps in range(19):
        logs, holds = logs_of(2.0 ** (half_steps / 2 - 3)), True
        for speed in range(len(known)):
            for rate in (0.01, 0.05):
                own = at == speed
                flagged = math.fsum(weights[own & (logs < math.log(rate))])
                holds &= flagged <= rate * math.fsum(weights[own])
        if holds:
            expected = 2.0 ** (half_steps / 2 - 3)
            break
    scale, found = healthy_limits.drift_scale(healthy, limits)
    assert scale == pytest.approx(2 * expected)
    np.testing.assert_allclose(found, logs_of(2 * expected), atol=1e-9)
