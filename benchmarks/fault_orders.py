"""Fault locations by the orders of the bearing, without recorded faults.

Whole recordings at the nominal speed, and rows of 1 s. Every method has the bearing and
the speed. Peers have the first 5 s of a recording.
"""

import numpy as np
from scipy.signal import hilbert

from benchmarks.rigs import BEARING_RIGS, read_rigs
from skarxlag import bearing_orders, make_fault_order_classifier
from skarxlag.core.fault_locations import HEALTHY, NO_FINDING

FAULTS = ("ball", "inner", "outer")
_SECONDS = 5
#: Share of the frequency within which a peak counts; multiples that are searched.
_TOLERANCE = 0.03
_MULTIPLES = (1, 2, 3)
#: Orders on each side whose median is the floor of a peak, and numbers of equal bands.
_AROUND = 0.6
_BANDS = (1, 2, 4, 8)


def orders_of(bearing):
    """Return the orders of impacts at ball, inner and outer race."""
    orders = bearing_orders(bearing)
    return [2 * orders["spin"], orders["inner"], orders["outer"]]


def order_contrasts(X, rpm, rate, bearing):
    """Compute the contrast of the three orders in squared envelopes of bands.

    A textbook analysis: the squared envelope (analytic signal by FFT) of a row in 1, 2, 4
    and 8 equal bands, its periodogram with a Hann window, and at three multiples of each
    order the largest cell within 3 % over the median of the cells within .6 orders, as a
    logarithm, less what the largest of so many cells of noise gives. Mean over multiples
    and bands.

    Returns
    -------
    ndarray of shape (n_rows, 3)
    """
    speeds = np.broadcast_to(rpm, len(X))
    orders = orders_of(bearing)
    rows = zip(X, speeds, strict=True)
    return np.array(
        [_contrasts_of_row(row, speed / 60, rate, orders) for row, speed in rows]
    )


def _contrasts_of_row(samples, shaft, rate, orders):
    n = len(samples)
    spectrum = np.fft.fft(samples - samples.mean())[: n // 2]
    cell = rate / n / shaft
    contrasts = []
    for n_bands in _BANDS:
        for band in np.array_split(spectrum, n_bands):
            envelope = np.abs(np.fft.ifft(band)) ** 2
            envelope = (envelope - envelope.mean()) * np.hanning(len(envelope))
            power = np.log(np.abs(np.fft.rfft(envelope)) ** 2 + np.finfo(float).tiny)
            contrasts.append([_contrast(power, order, cell) for order in orders])
    return np.mean(contrasts, axis=0)


def _contrast(power, order, cell):
    heights = []
    for multiple in _MULTIPLES:
        center = multiple * order / cell
        near = power[
            int(center * (1 - _TOLERANCE)) : int(center * (1 + _TOLERANCE)) + 2
        ]
        reach = _AROUND / cell
        around = power[max(int(center - reach), 1) : int(center + reach) + 2]
        if len(near) == 0:
            continue
        # The largest of m cells of noise over their median; a Hann cell is half a cell.
        of_noise = np.log((np.log(len(near) / 2 + 1) + 0.58) / np.log(2))
        heights.append(near.max() - np.median(around) - of_noise)
    return np.mean(heights) if heights else 0.0


def ours(rows, rpm, rate, bearing):
    """Return log probabilities of the faults, the names and their probabilities."""
    classifier = make_fault_order_classifier(bearing=bearing, sampling_rate=rate)
    fitted = classifier.fit(rows)
    found = fitted.diagnose(rows, rpm=rpm)
    logs = found.score[:, [list(fitted.classes_).index(fault) for fault in FAULTS]]
    # Lines of results call a row without a comb healthy.
    named = np.where(found.named == NO_FINDING, HEALTHY, found.named)
    return logs, named, found.probability.max(axis=1)


def contrasts(rows, rpm, rate, bearing):
    """Return the scores of the textbook analysis, which names nothing healthy."""
    return order_contrasts(rows, rpm, rate, bearing), None, None


def _of_spectrum(spectrum):
    """Make a peer that takes the largest peaks of an envelope spectrum."""

    def scores(rows, rpm, rate, bearing):
        found = []
        for row in rows:
            frequencies, power = spectrum(row, rate)
            power = np.log(np.asarray(power) ** 2 + 1e-12 * np.mean(power) ** 2)
            cell = frequencies[1] / (rpm / 60)
            orders = orders_of(bearing)
            found.append([_largest_peaks(power, order, cell) for order in orders])
        return np.array(found), None, None

    return scores


def _largest_peaks(power, order, cell):
    heights = []
    for multiple in _MULTIPLES:
        center = multiple * order / cell
        near = power[
            int(center * (1 - _TOLERANCE)) : int(center * (1 + _TOLERANCE)) + 1
        ]
        around = power[int(center * 0.85) : int(center * 1.15) + 1]
        heights.append(near.max() - np.median(around) if len(near) else 0.0)
    return np.mean(heights)


def _plain_envelope(row, rate):
    envelope = np.abs(hilbert(row - row.mean())) ** 2
    power = np.abs(np.fft.rfft(envelope - envelope.mean()))
    return np.fft.rfftfreq(len(row), 1 / rate), power


def _openconmo(row, rate):
    from openconmo.benchmark_methods import envelope

    return envelope(row, rate)


def _openconmo_prewhitened(row, rate):
    from openconmo.benchmark_methods import cepstrum_prewhitening, envelope

    return envelope(cepstrum_prewhitening(row, rate)[1], rate)


def maintenance_server(rows, rpm, rate, bearing):
    """Rank the evidence that predictive-maintenance-mcp states for each frequency."""
    from predictive_maintenance_mcp.diagnostics.bearing_analyzer import (
        check_bearing_fault_peak,
    )

    grades = ("none", "low", "moderate", "high")
    scores = []
    for row in rows:
        of_row = []
        for name, order in zip(
            ("BSF", "BPFI", "BPFO"), orders_of(bearing), strict=True
        ):
            evidence = check_bearing_fault_peak(
                signal=row,
                fs=rate,
                expected_freq=order * rpm / 60,
                fault_type=name,
                bearing_id="",
            )
            # The magnitude breaks ties between grades.
            magnitude = evidence["magnitude"] or 0.0
            grade = grades.index(evidence["evidence_strength"])
            of_row.append(grade + magnitude / (1 + magnitude))
        scores.append(of_row)
    return np.array(scores), None, None


METHODS = {
    "make_fault_order_classifier": ours,
    "order contrasts of bands (textbook)": contrasts,
    "envelope spectrum, largest peaks": _of_spectrum(_plain_envelope),
}
#: Peers in packages of their own. They are computed only if they are named.
SLOW = {
    "openconmo, envelope": _of_spectrum(_openconmo),
    "openconmo, prewhitening": _of_spectrum(_openconmo_prewhitened),
    "predictive-maintenance-mcp": maintenance_server,
}
#: Rows of a recording: all of it, its first 5 s, or each second.
LENGTHS = ("whole", "5 s", "1 s")
OURS = tuple(METHODS)[:1]


def lines(home=None, rigs=BEARING_RIGS, methods=METHODS, lengths=LENGTHS, every=1):
    """Yield what each method says of each recording: a line for each row.

    Peers receive the first 5 s only.

    Parameters
    ----------
    home : path or None
        Folder of the rigs.
    rigs, methods, lengths : sequence of str
        Those that are computed.
    every : int
        Of so many recordings one is taken.
    """
    for rig in read_rigs(rigs, home):
        for number, recording in list(enumerate(rig.recordings))[::every]:
            for length in lengths:
                rows = rows_of_length(recording.samples, length, rig.sampling_rate)
                for method in methods:
                    if method not in OURS and length != "5 s":
                        continue
                    score = (METHODS | SLOW)[method]
                    found = score(rows, recording.rpm, rig.sampling_rate, rig.bearing)
                    facts = {"rig": rig.name, "length": length, "method": method}
                    facts |= {"recording": number, "location": recording.location}
                    facts |= {"rpm": recording.rpm, "specimen": recording.specimen}
                    yield from _lines_of(facts, *found)


def rows_of_length(samples, length, rate):
    """Cut a recording into rows.

    Examples
    --------
    >>> rows_of_length(np.arange(5), "1 s", 2)
    array([[0, 1],
           [2, 3]])
    """
    if length == "1 s":
        size = int(rate)
        return samples[: len(samples) // size * size].reshape(-1, size)
    return samples[np.newaxis, : int(_SECONDS * rate) if length == "5 s" else None]


def _lines_of(facts, scores, named, probability):
    for row, of_row in enumerate(scores):
        first = FAULTS[int(np.argmax(of_row))]
        line = facts | {"row": row, "first": first, "score": round(max(of_row), 4)}
        if named is not None:
            line |= {
                "named": named[row],
                "probability": round(float(probability[row]), 4),
            }
        yield line
