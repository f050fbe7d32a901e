"""RMS of the velocity."""

import numpy as np
import pytest

from skarxlag.measures.velocity import velocity_rms

RATE = 4000
TIME = np.arange(2 * RATE) / RATE


def tones(*frequencies):
    """Sum of sines with the amplitude 1."""
    return sum(np.sin(2 * np.pi * frequency * TIME) for frequency in frequencies)


@pytest.mark.parametrize(
    ("unit", "frequencies", "expected"),
    [
        ("mm/s", (50,), np.sqrt(1 / 2)),
        ("m/s", (50, 80), 1000.0),
        ("mm/s2", (50,), np.sqrt(1 / 2) / (100 * np.pi)),
        ("m/s2", (50,), 1000 * np.sqrt(1 / 2) / (100 * np.pi)),
        ("g", (200,), 9806.65 * np.sqrt(1 / 2) / (400 * np.pi)),
        # Frequencies outside the band of the standard do not count.
        ("mm/s", (5, 50, 1500), np.sqrt(1 / 2)),
    ],
)
def test_tones_have_the_velocity_of_their_integral(unit, frequencies, expected):
    signal = 3.0 + tones(*frequencies)
    assert velocity_rms(signal, RATE, unit) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("n_samples", "rate", "unit"),
    [
        (8000, 4000, "V"),
        (8000, 4000, None),
        (8000, None, "g"),
        (8000, 1999, "g"),
        (1999, 4000, "g"),
    ],
)
def test_what_is_not_known_has_no_velocity(n_samples, rate, unit):
    assert velocity_rms(np.ones(n_samples), rate, unit) is None
