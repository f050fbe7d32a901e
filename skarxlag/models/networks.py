"""Orders and poles of the Laguerre networks, one for each channel."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import check_scalar

from ..core.state import expect
from ..core.validation import WITHIN_1, check_count, check_real
from ..kernels import pole_search
from .weighted_windows import WeightedWindows

#: Order that windows of any length may have. Beyond it, a window has at least as many
#: samples.
_ORDER_OF_ANY_WINDOW = 64


def choose_networks(
    order: int | Sequence[int],
    pole: float | str | Sequence[float | str],
    models: Sequence[WeightedWindows],
    alpha: float,
    n_jobs: int | None,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return orders and poles of the networks, and search the poles that are not given.

    Parameters
    ----------
    order : int or sequence of int
        As in `ARXLaguerre`.
    pole : float, str or sequence of these
        As in `ARXLaguerre`.
    models : sequence of WeightedWindows
        Windows of each model.
    alpha : float
        Ridge parameter.
    n_jobs : int or None
        Threads.

    Returns
    -------
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    """
    _, n_channels, n_samples = models[0].windows.shape
    orders, poles = _networks_given(order, pole, n_channels)
    name = f"order for windows of {n_samples} samples"
    most = max(n_samples, _ORDER_OF_ANY_WINDOW)
    check_scalar(orders.max(), name, Integral, max_val=most)
    if None in poles:
        spectra = np.stack([model.cross_spectra(n_jobs) for model in models])
        poles = pole_search.search_poles(spectra, orders, poles, alpha)
    return orders, np.asarray(poles, dtype=np.float64)


def check_same_networks(
    order: Any, pole: Any, orders: NDArray[Any], poles: NDArray[Any]
) -> None:
    """Raise a ValueError if the parameters do not give the networks of `fit`."""
    orders_given, poles_given = _networks_given(order, pole, len(orders))
    are_same_poles = [
        given in (None, fitted)
        for given, fitted in zip(poles_given, poles, strict=True)
    ]
    are_same = all(orders_given == orders) and all(are_same_poles)
    expected = f"those of fit, {orders} and {poles}, or another fit"
    expect(are_same, "(order, pole)", (order, pole), expected)


def _networks_given(order, pole, n_channels):
    """Return order and pole of each channel's network; None for a pole to search."""
    orders = _value_of_channels("order", order, n_channels)
    poles = _value_of_channels("pole", pole, n_channels)
    for value in orders:
        check_count(value, "order")
    for value in poles:
        if not isinstance(value, str):
            check_real(value, "pole", **WITHIN_1)
        elif value != "optimise":
            raise ValueError(f"pole == {value!r}, must be in (-1, 1) or 'optimise'.")
    given = [None if isinstance(value, str) else value for value in poles]
    return np.array(orders), given


def _value_of_channels(name, value, n_channels):
    values = [value] * n_channels if np.ndim(value) == 0 else list(value)
    if len(values) == 2:
        of_output, of_inputs = values
        values = [of_output, *[of_inputs] * (n_channels - 1)]
    expected = (
        f"one value, two (of output and inputs), or {n_channels}, one for each channel"
    )
    expect(len(values) == n_channels, name, value, expected)
    return values
