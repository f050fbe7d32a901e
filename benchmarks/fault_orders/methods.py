"""Methods that score fault locations: ours, and those of other packages.

A method takes a recording and returns one score for each location, (ball, inner, outer).
"""

import numpy as np

from skarxlag import (
    FaultOrderClassifier,
    envelope_spectrum,
    make_fault_order_classifier,
)
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS

#: Tolerance of a peak's frequency, as a share.
_TOLERANCE = 0.03


def orders_of(recording):
    """Return the orders of impacts at the locations."""
    _, spin, inner, outer = recording.orders
    return {"ball": 2 * spin, "inner": inner, "outer": outer}


def classifier(recording):
    """Classify by the contrast over orders, without a model."""
    options = {"bearing": recording.bearing, "sampling_rate": recording.rate}
    X = recording.samples[np.newaxis]
    fitted = FaultOrderClassifier(**options).fit(X)
    return fitted.match(X, rpm=recording.rpm).scores[0]


def behind_model(recording):
    """Classify the innovations of an ARX-Laguerre model of the recording."""
    X = recording.samples[np.newaxis]
    pipeline = make_fault_order_classifier(
        bearing=recording.bearing, sampling_rate=recording.rate
    ).fit(X)
    return pipeline[-1].match(pipeline[:-1].transform(X), rpm=recording.rpm).scores[0]


def largest_peaks(frequencies, power, recording, n_multiples=3):
    """Mean log of the largest peaks near multiples of each order, over the median around."""
    power = np.log(power + 1e-12 * power.mean())
    cell = frequencies[1]
    scores = []
    for order in orders_of(recording).values():
        heights = []
        for multiple in range(1, n_multiples + 1):
            centre = multiple * order * recording.rpm / 60 / cell
            near = power[
                int(centre * (1 - _TOLERANCE)) : int(centre * (1 + _TOLERANCE)) + 1
            ]
            around = power[int(centre * (1 - 0.15)) : int(centre * (1 + 0.15)) + 1]
            heights.append(near.max() - np.median(around) if len(near) else 0.0)
        scores.append(np.mean(heights))
    return scores


def largest_peak(recording):
    """Take the largest peaks of the envelope spectrum, without prewhitening."""
    spectrum = envelope_spectrum(
        _five_seconds(recording), recording.rate, prewhiten=False
    )
    return largest_peaks(*spectrum, recording)


def _five_seconds(recording):
    return recording.samples[: int(5 * recording.rate)]


def openconmo_envelope(recording):
    """Take the largest peaks of openconmo's squared envelope spectrum."""
    from openconmo.benchmark_methods import envelope

    frequencies, power = envelope(_five_seconds(recording), recording.rate)
    return largest_peaks(frequencies, np.asarray(power) ** 2, recording)


def openconmo_prewhitening(recording):
    """Take the largest peaks after openconmo's cepstrum prewhitening."""
    from openconmo.benchmark_methods import cepstrum_prewhitening, envelope

    _, white = cepstrum_prewhitening(_five_seconds(recording), recording.rate)
    frequencies, power = envelope(white, recording.rate)
    return largest_peaks(frequencies, np.asarray(power) ** 2, recording)


def openconmo_kurtogram(recording):
    """Take the largest peaks in openconmo's band of the largest kurtosis, without its lines."""
    from openconmo.benchmark_methods import benchmark_method

    _, _, frequencies, power = benchmark_method(
        _five_seconds(recording), recording.rate
    )
    return largest_peaks(frequencies, np.asarray(power) ** 2, recording)


def predictive_maintenance(recording):
    """Rank the evidence that predictive-maintenance-mcp states for each frequency."""
    from predictive_maintenance_mcp.diagnostics.bearing_analyzer import (
        check_bearing_fault_peak,
    )

    grades = {"none": 0, "low": 1, "moderate": 2, "high": 3}
    names = {"ball": "BSF", "inner": "BPFI", "outer": "BPFO"}
    scores = []
    for location, order in orders_of(recording).items():
        evidence = check_bearing_fault_peak(
            signal=_five_seconds(recording),
            fs=recording.rate,
            expected_freq=order * recording.rpm / 60,
            fault_type=names[location],
            bearing_id="",
        )
        # The magnitude breaks ties between grades.
        magnitude = evidence["magnitude"] or 0.0
        scores.append(
            grades[evidence["evidence_strength"]] + magnitude / (1 + magnitude)
        )
    return scores


def pybearing(recording):
    """Compare pyBearing's root mean square about each frequency of the envelope."""
    from pybearing.analysis.envelope_analysis import (
        envelope_extraction,
        rms_around_fault_frequencies_of_envelope,
    )
    from pybearing.core.fault_frequencies import FaultFrequencies

    fs = int(recording.rate)
    shaft = recording.rpm / 60
    samples = _five_seconds(recording)
    envelope = envelope_extraction(samples, fs, (0.25 * fs, 0.49 * fs))
    cage, spin, inner, outer = recording.orders * shaft
    frequencies = FaultFrequencies(
        f_cage=cage,
        f_rolling_element_about_axis=spin,
        f_outer_ring=outer,
        f_rolling_element=2 * spin,
        f_inner_ring=inner,
    )
    envelope = envelope - envelope.mean()
    levels = rms_around_fault_frequencies_of_envelope(envelope, fs, frequencies)
    names = {"ball": "rolling_element", "inner": "inner_ring", "outer": "outer_ring"}
    return [
        levels[f"rms_f_{names[location]}"] / envelope.std()
        for location in FAULT_LOCATIONS
    ]


METHODS = {
    "FaultOrderClassifier": classifier,
    "behind ARXLaguerre(order=8)": behind_model,
    "largest peaks at the orders": largest_peak,
}
#: Methods that need other packages.
PEERS = {
    "openconmo, envelope": openconmo_envelope,
    "openconmo, prewhitening": openconmo_prewhitening,
    "openconmo, kurtogram": openconmo_kurtogram,
    "predictive-maintenance-mcp": predictive_maintenance,
    "pyBearing": pybearing,
}
