"""Run ``skarxlag bearings``: list the catalogue, or the bearings that fit a recording."""

import argparse

import numpy as np
import pandas as pd

from ...bearings import BEARINGS, bearing_orders
from ...core.validation import output_of_windows
from ...decisions.comb_search import CombSearch
from ...decisions.fault_orders import FaultOrderClassifier
from ...kernels.fault_orders import FAULTS, NEPER_IN_DB, order_contrast
from ...measures.envelope_spectra import (
    LEAST_REVOLUTIONS,
    samples_per_revolution_of_rows,
)
from ..readers.formats.rates import NO_RATE
from ..readers.listing import ListedRecording
from .messages import CommandError, as_command_error, show

#: Samples of a recording that are searched, and bearings that are printed.
_N_SAMPLES = 2**20
_N_SHOWN = 10
#: Orders in the order of the columns.
_COLUMNS = {"outer": "BPFO", "inner": "BPFI", "ball": "2 BSF", "cage": "FTF"}


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    table = catalogue()
    if args.recordings:
        table = fitting_bearings(args.recordings[0]).head(_N_SHOWN).join(table)
    show(table.to_string(float_format="{:.3f}".format))
    return 0


def catalogue() -> pd.DataFrame:
    """Return the orders of the bearings of the catalogue, a row for each.

    Examples
    --------
    >>> catalogue().loc["6205"].round(3).to_dict()
    {'BPFO': 3.585, 'BPFI': 5.415, '2 BSF': 4.713, 'FTF': 0.398}
    """
    orders = {name: bearing_orders(name) for name in BEARINGS}
    return pd.DataFrame(orders).T[[*_COLUMNS]].rename(columns=_COLUMNS)


def fitting_bearings(recording: ListedRecording) -> pd.DataFrame:
    """Return the strongest comb of each bearing in a recording, the best bearing first.

    Parameters
    ----------
    recording : ListedRecording
        The recording, of which at most the first million samples are read.

    Returns
    -------
    DataFrame
        Columns ``comb_dB``, the contrast of the strongest comb, ``off_%``, how far its
        lines are from the nominal orders, and ``fault``, its location. The index is the
        bearing.

    Raises
    ------
    CommandError
        If the recording cannot be read, its sampling rate or its speed is missing, or
        it has less than two revolutions.
    """
    with as_command_error():
        opened = recording.open(_N_SAMPLES, reads_speed=True)
        X = output_of_windows(next(opened.blocks)[np.newaxis])[:, np.newaxis]
    rate = opened.sampling_rate
    if rate is None:
        raise CommandError(f"{recording.name}: {NO_RATE}")
    if opened.entry.rpm is None:
        raise CommandError(
            f"{recording.name}: the speed is missing; state it with --rpm"
        )
    rpm = opened.entry.speeds([0], X.shape[-1], rate)
    (period,) = samples_per_revolution_of_rows(X, rate, rpm, None, LEAST_REVOLUTIONS)
    if np.isnan(period).any():
        raise CommandError(
            f"{recording.name}: no plausible speed, or less than "
            f"{LEAST_REVOLUTIONS} revolutions"
        )
    contrasts = order_contrast(X[0, 0], period)
    usual = FaultOrderClassifier()
    rows = {}
    for name in BEARINGS:
        search = CombSearch(
            bearings=[name],
            sampling_rate=rate,
            gear_ratio=usual.gear_ratio,
            speed_tolerance=usual.speed_tolerance,
            slip=usual.slip,
            speed_range=None,
        )
        _, found = search.match_contrasts(contrasts, X.shape[-1], np.mean(period))
        best = int(np.argmax(found["scores"]))
        rows[name] = {
            "comb_dB": NEPER_IN_DB * found["scores"][best],
            "off_%": 100 * (found["factors"][best] - 1),
            "fault": FAULTS[best],
        }
    table = pd.DataFrame.from_dict(rows, orient="index")
    # Bearings of nearly equal orders fit the same lines.
    keys = [-table["comb_dB"].round(1), table["off_%"].abs()]
    return table.iloc[np.lexsort(keys[::-1])]
