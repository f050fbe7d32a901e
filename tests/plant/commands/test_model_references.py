"""Curves of the healthy condition that a model learned, next to a recording."""

import re

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import LogSpectra, SpectralDistance, make_alpio, make_diagnoser
from skarxlag.plant.pages.model_references import (
    healthy_shape,
    order_references_figure,
    shape_reference_figure,
)


@pytest.fixture(scope="module")
def learned():
    """Log spectra of two conditions at 600 and 1200 rpm, and their distance."""
    rng = np.random.default_rng(0)
    rpm = np.repeat([600.0, 1200.0], 20)
    rows = [
        lfilter([1.0], [1.0, -speed / 2000], rng.normal(size=1200)) for speed in rpm
    ]
    labels = np.tile(["good", "worn"], 20)
    spectra = LogSpectra().fit_transform(np.array(rows))
    return spectra, labels, rpm, SpectralDistance().fit(spectra, labels, rpm=rpm)


@pytest.mark.parametrize("rpm", [600.0, 1200.0])
def test_the_reference_at_a_training_speed_is_the_mean_spectrum(learned, rpm):
    spectra, labels, speeds, distance = learned
    for group in range(2):
        mean = spectra[(labels == "good") & (speeds == rpm), group].mean(axis=0)
        shape = healthy_shape(distance, rpm, 0, group)
        np.testing.assert_allclose(shape, mean - mean.mean(), atol=1e-9)


def test_the_reference_between_speeds_lies_between(learned):
    """It is linear in the logarithm of the speed; without a speed, it is the middle."""
    distance = learned[-1]
    slow, fast = (healthy_shape(distance, rpm, 0, 0) for rpm in (600.0, 1200.0))
    middle = healthy_shape(distance, np.sqrt(600.0 * 1200.0), 0, 0)
    np.testing.assert_allclose(middle, (slow + fast) / 2, atol=1e-12)
    np.testing.assert_allclose(healthy_shape(distance, None, 0, 0), middle, atol=1e-12)


@pytest.fixture(scope="module")
def rows():
    noise = np.random.default_rng(1).normal(size=(40, 1200))
    X = np.concatenate([noise[:20], lfilter([1.0], [1.0, -0.9], noise[20:])])
    return X, np.repeat(["good", "worn"], 20)


def test_a_diagnoser_draws_its_healthy_condition(rows):
    diagnoser = make_diagnoser(healthy="good").fit(*rows)
    figure = shape_reference_figure(diagnoser, rows[0][-1], None, "good", 8000.0)
    assert [mark.label for mark in figure.marks] == ["learned: good", "this recording"]
    assert figure.x.high == 4000.0


def test_a_stretch_is_measured_in_windows(rows):
    """The power of an AR(1) process is that of its transfer function."""
    rng = np.random.default_rng(2)
    X = rng.normal(size=(12, 20_000))
    X[6:] = lfilter([1.0], [1.0, -0.9], X[6:])
    labels = np.repeat(["good", "worn"], 6)
    diagnoser = make_diagnoser(sampling_rate=10_000, healthy="good")
    diagnoser.fit(X, labels, rpm=600)
    good, worn = (
        shape_reference_figure(diagnoser, row, 600.0, "good", 10_000.0)
        for row in X[[0, -1]]
    )
    heights = []
    for figure in (good, worn):
        ends = np.array(re.findall(r"[ML]\d+ (\d+)", figure.marks[1].path), dtype=float)
        reference = np.array(
            re.findall(r"[ML]\d+ (\d+)", figure.marks[0].path), dtype=float
        )
        range_in_db = figure.y.high - figure.y.low
        above = (reference - ends) / 240 * range_in_db
        heights.append(above[1] - above[-2])
    omega = np.pi * (np.array([1, len(ends) - 2]) + 0.5) / len(ends)
    slow, fast = -20 * np.log10(np.abs(1 - 0.9 * np.exp(-1j * omega)))
    assert heights[0] == pytest.approx(0.0, abs=1.5)
    assert heights[1] == pytest.approx(slow - fast, abs=1.5)


def test_models_that_compare_other_things_draw_nothing(rows):
    alpio = make_alpio(healthy="good").fit(*rows)
    with pytest.raises(ValueError, match="no fitted LogSpectra"):
        shape_reference_figure(alpio, rows[0][0], None, "good", None)
    with pytest.raises(ValueError, match="No step compares order spectra"):
        order_references_figure(alpio, rows[0][0], None, "good")
    diagnoser = make_diagnoser().fit(*rows)
    with pytest.raises(ValueError, match="None"):
        shape_reference_figure(diagnoser, rows[0][0], None, None, None)
