"""Equations (21)-(32) as printed: what their residual and thresholds can distinguish."""

import numpy as np
import pytest

from skarxlag.kernels.ladder import rung_scores
from skarxlag.kernels.residual_levels import sliding_surface

CUTS = [0.5, 1, 2, 3, 4, 6, 8]  # Section 5: Gamma, ball, inner, outer, inner-ball, ...
CONDITIONS = ["normal", "b", "i", "o", "ib", "ob", "io", "iob"]
# Eq. (32): label of each printed row and how many of (Gamma, b, i, o, ib, ob, io, iob)
# r exceeds.
PRINTED_ROWS = [
    ("b", 1),
    ("i", 2),
    ("o", 3),
    ("ib", 4),
    ("ob", 4),
    ("ob", 5),
    ("io", 5),
    ("io", 6),
]


def broadband_errors():
    return [
        scale * np.random.default_rng(0).normal(size=5000) for scale in (0.25, 1.0, 9.5)
    ]


def fired(level, thresholds):
    """Labels of the rows of Eq. (32) that hold, all comparisons strict as printed."""
    above = np.array(thresholds) < level
    below = np.array(thresholds) > level
    return [label for label, n in PRINTED_ROWS if above[:n].all() and below[n:].all()]


def test_residual_of_equation_21_is_the_same_for_every_condition():
    levels = [
        np.sqrt(np.mean((0.7 * np.sign(error)) ** 2)) for error in broadband_errors()
    ]
    np.testing.assert_allclose(levels, 0.7)


@pytest.mark.parametrize("slope", [0.1, 1.0, 10.0])
def test_decisions_of_equations_21_to_32_do_not_see_amplitude(slope):
    decisions = []
    for error in broadband_errors():
        residual = 0.7 * np.sign(error)
        signs = np.sign(sliding_surface(error, slope))
        decisions.append([residual < gain * signs for gain in CUTS])
    np.testing.assert_array_equal(decisions[0], decisions[1])
    np.testing.assert_array_equal(decisions[0], decisions[2])
    assert 0 < np.mean(decisions[0]) < 1


def test_derivative_of_equation_22_needs_the_sampling_period():
    # A difference quotient in seconds at 250 kHz leaves no weight to the error itself.
    error, slope, rate = broadband_errors()[1], 10.0, 250e3
    quotient = slope * error[1:] + np.diff(error) * rate
    assert np.corrcoef(quotient, np.diff(error))[0, 1] > 0.999999
    assert np.corrcoef(sliding_surface(error, slope)[1:], np.diff(error))[0, 1] < 0.9


def test_detection_without_absolute_value_is_blind_on_one_side():
    residual = 0.9 * np.sign(broadband_errors()[2])
    assert np.mean(residual > 0.5) == pytest.approx(0.5, abs=0.03)
    assert np.mean(np.abs(residual) > 0.5) == 1


def test_rows_of_equation_32_contradict_each_other():
    thresholds = [*CUTS, np.inf]
    assert fired(3.5, thresholds) == ["ib", "ob"]
    assert fired(5.0, thresholds) == ["ob", "io"]
    assert len(PRINTED_ROWS) == 8 and len({n for _, n in PRINTED_ROWS}) == 6


def test_a_condition_and_equality_have_no_row_in_equation_32():
    thresholds = [*CUTS, 10.0]
    labels = [fired(level, thresholds) for level in np.linspace(0.01, 20, 4003)]
    assert all("iob" not in each for each in labels)
    assert fired(9.0, thresholds) == [] and fired(12.0, thresholds) == []
    assert fired(2.0, thresholds) == []


def test_bands_of_section_5_are_seven_cuts_for_eight_conditions():
    levels = np.array([0.25, 0.75, 1.5, 2.5, 3.5, 5.0, 7.0, 20.0])
    rungs = np.argmax(rung_scores(levels, np.array(CUTS, dtype=float)), axis=1)
    assert [CONDITIONS[rung] for rung in rungs] == CONDITIONS
    # Without the repeated rows Eq. (32) agrees with these bands, but for the last
    # condition.
    kept = [row for row in PRINTED_ROWS if row not in [("ob", 4), ("io", 5)]]
    assert kept == [(CONDITIONS[n], n) for n in range(1, 7)]


def test_order_of_the_thresholds_named_after_equation_32():
    named = [
        "Gamma",
        "o",
        "i",
        "b",
        "ob",
        "ib",
        "io",
    ]  # for r_b, r_i, r_o, r_ib, r_ob, r_io, r_iob
    ladder = [
        "Gamma",
        "b",
        "i",
        "o",
        "ib",
        "ob",
        "io",
    ]  # the cut below each band of Section 5
    assert sum(a != b for a, b in zip(named, ladder, strict=True)) == 4
    assert sorted(named) == sorted(ladder)
