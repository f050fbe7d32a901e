import numpy as np
import pytest

from skarxlag import envelope_spectrum


def test_envelope_spectrum_of_a_band():
    time = np.arange(20_000) / 20_000
    rng = np.random.default_rng(7)
    carrier = np.sin(2 * np.pi * 6000 * time) * (
        1 + 0.8 * np.sin(2 * np.pi * 37 * time)
    )
    other = (
        5 * np.sin(2 * np.pi * 2000 * time) * (1 + 0.8 * np.sin(2 * np.pi * 81 * time))
    )
    signal = carrier + other + 0.01 * rng.normal(size=len(time))
    options = {"prewhiten": False}
    frequencies, power = envelope_spectrum(signal, 20_000, band=(5000, 7000), **options)
    assert frequencies[power.argmax()] == 37
    frequencies, power = envelope_spectrum(signal, 20_000, **options)
    assert frequencies[power[:200].argmax()] == 81
    with pytest.raises(ValueError, match=r"band == \(7000, 5000\)"):
        envelope_spectrum(signal, 20_000, band=(7000, 5000))
    with pytest.raises(ValueError, match="expected one axis"):
        envelope_spectrum(np.ones((9, 9)), 20_000)
