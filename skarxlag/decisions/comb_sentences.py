"""Sentences on the combs of rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ..bearings import BearingLike
from ..kernels.fault_orders import NEPER_IN_DB
from ..measures.envelope_spectra import impact_orders
from .comb_limits import ComparedCombs

#: Faults in words, and orders of their impacts, in the order of `FAULTS`.
_WORDS = "a rolling element", "the inner race", "the outer race"
_ORDERS = "2 BSF", "BPFI", "BPFO"
#: Error of the stated speed in per cent from which on a sentence states it.
_SPEED_REMARK = 1.0


def comb_sentences(
    matches: Bunch,
    compared: ComparedCombs,
    bearings: Sequence[BearingLike],
    orders: NDArray[Any],
) -> NDArray[np.object_]:
    """Describe the strongest comb of each row in a sentence.

    Parameters
    ----------
    matches : Bunch
        As `CombSearch.match` returns it.
    compared : ComparedCombs
        Its scores, compared with those of healthy rows.
    bearings : sequence of BearingLike
        The bearings as the user gave them.
    orders : ndarray of shape (n_bearings, 4)
        Their orders, see `orders_of_bearings`.

    Returns
    -------
    ndarray of str of shape (n_rows,)
        The sentences, without a period.
    """
    nominal_orders = impact_orders(orders)
    sentences = []
    for row, (best, second) in enumerate(compared.ranking):
        bearing = matches.bearings[row, best]
        location = _WORDS[best]
        if isinstance(bearings[bearing], str):
            location += f" of {bearings[bearing]}"
        elif len(bearings) > 1:
            location += f" of bearing {bearing + 1}"
        size = f"{NEPER_IN_DB * matches.scores[row, best]:.0f} dB"
        factor = matches.factors[row, best]
        order = nominal_orders[bearing, best] * factor
        other = matches.other_scores[row]
        other_train = (
            f"impacts of {NEPER_IN_DB * other:.0f} dB at "
            f"{matches.other_orders[row]:.2f} orders, which is no order of this bearing"
        )
        of_shaft = matches.shaft_scores[row]
        score_limit = compared.score_limits[row]
        limit = f"{NEPER_IN_DB * score_limit:.0f} dB"
        if not compared.alarm[row] and of_shaft > max(other, score_limit):
            sentence = (
                f"lines of {NEPER_IN_DB * of_shaft:.0f} dB at multiples of the shaft: "
                "imbalance, misalignment or looseness"
            )
        elif not compared.alarm[row] and other > score_limit:
            sentence = other_train
        elif not compared.alarm[row]:
            sentence = (
                "no comb exceeds its limit; the strongest is that of "
                f"{location} with {size}, limit {limit}"
            )
        elif compared.is_close[row]:
            rival = _WORDS[second]
            sentence = f"impacts of {size} fit {location} and {rival} nearly as well"
        else:
            sentence = (
                f"impacts at {order:.2f} orders ({_ORDERS[best]}), {location}, {size}, "
                f"{100 * (factor - 1):+.1f} % from the nominal order"
            )
            if other > matches.scores[row, best]:
                sentence += f"; {other_train}"
        error = 100 * (matches.speed_errors[row] - 1)
        if abs(error) > _SPEED_REMARK:
            sentence += (
                f"; the lines of the shaft show {matches.rpm[row]:.0f} rpm, "
                f"{error:+.1f} % from the stated speed"
            )
        sentences.append(sentence)
    return np.array(sentences, dtype=object)
