"""Residual of rows of any length: spectra of the windows in a row, and orders of the shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.utils import check_scalar

from ..core.base import StretchTransformer
from ..core.capabilities import requests
from ..core.pipelines import DiagnosisPipeline
from ..core.speeds import REVOLUTIONS_LEFT, log_speeds, speeds_of_rows
from ..core.validation import check_count, check_real
from ..kernels.order_spectra import LEAST_SAMPLES
from ..measures.spectra import LogSpectra
from .comparison import SpectralDistance
from .orders import OrderResidual

#: Weight of the orders, chosen on the six rigs of docs/cross_speed.md together.
ORDER_WEIGHT = 0.5
#: Assumed speed of the shaft in revolutions per minute if `fit` is not given the speeds
#: of rows. It decides whether rows are long enough for orders.
_SUPPOSED_RPM = 600


def window_comparison(n_jobs: int | None = None) -> DiagnosisPipeline:
    """Make the steps of `make_diagnoser` between its model and its decision.

    Parameters
    ----------
    n_jobs : int or None, default=None
        Number of threads.

    Returns
    -------
    DiagnosisPipeline
        Steps "measure" and "compare".
    """
    measure = ("measure", LogSpectra(n_jobs=n_jobs))
    compare = ("compare", SpectralDistance())
    return DiagnosisPipeline([measure, compare], n_jobs=n_jobs)


@dataclass(kw_only=True, eq=False, repr=False)
class StretchResidual(StretchTransformer):
    r"""Transformer from rows of any length to residuals of their windows and order spectra.

    A residual of *windows* compares colour and steadiness of the innovations with those
    of each condition. `OrderResidual` compares the orders of the shaft at which impacts
    repeat. A change of speed disturbs the two in different ways. The residual of
    condition c is

    .. math::

        r_c = \Bigl(\prod_{w=1}^{m} r_{c,w}\Bigr)^{1/m} (r_c^{\mathrm{orders}})^q

    with :math:`r_{c,w}` the residual of window w of the m windows that fit into the
    row. Rows of less than three revolutions of the shaft, or of less than 32 samples, have
    no order spectra, and q is 0 for them. If `fit` is not given speeds, three revolutions
    are those at 600 rpm, 0.3 s.

    The speed of each row comes as the metadata `rpm`, which this estimator requests;
    see `SpectralDistance` and `OrderResidual` for what happens without it. Use
    `OrderResidual` instead to compare orders alone.

    Parameters
    ----------
    window_residual : estimator or None, default=None
        Computes a residual for each window and condition, and may have a method
        `adapt`. It must take `sample_weight` if `fit` is given weights. None stands for
        `LogSpectra` and `SpectralDistance` as `make_diagnoser` has them.
    order_residual : OrderResidual or None, default=None
        None stands for ``OrderResidual()``, which has no sampling rate: orders are
        compared only without `rpm`.
    order_weight : float, default=0.5
        The exponent q, at least 0.
    window_length : int, default=4800
        Samples in a window, at least 1. A shorter row is one window.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    window_residual_ : estimator
        The fitted residual of windows.
    order_residual_ : OrderResidual or None
        The fitted residual of order spectra. None if a training row has less than three
        revolutions.
    speeds_ : ndarray of shape (n_speeds,)
        Training speeds in revolutions per minute, ascending; speeds within 2 % count as
        one. Empty without `rpm`.
    window_shape_ : ndarray of int
        Shape of one training row.
    n_models_ : int
        Number of models that the innovations are from; 0 for plain rows.
    n_features_in_ : int
        Number of models, or samples in a plain row.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(12, 20_000))
    >>> X[6:, ::1_000] += 20                          # an impact every tenth of a second
    >>> y = np.repeat(["good", "worn"], 6)
    >>> residual = StretchResidual(order_residual=OrderResidual(sampling_rate=10_000))
    >>> residual.fit(X, y, rpm=600).transform(X, rpm=600).argmin(axis=1)
    array([0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1])
    """

    window_residual: Any = None
    order_residual: OrderResidual | None = None
    order_weight: float = ORDER_WEIGHT
    window_length: int = 4800

    _suffix = "stretch"

    def _learn(self, X, target, weights, rpm):
        y = self.classes_[target]
        orders = OrderResidual() if self.order_residual is None else self.order_residual
        self.order_residual_: OrderResidual | None = None
        if len(_long_rows(X, rpm, orders.sampling_rate)[0]) == len(X):
            self.order_residual_ = clone(orders).fit(
                X, y, rpm=rpm, sample_weight=weights
            )
        of_windows = self.window_residual or window_comparison()
        windows, n_windows, metadata = self._windows(X, rpm, of_windows, "fit")
        # A residual of windows need not take weights if there are none.
        if np.any(weights != 1):
            metadata["sample_weight"] = np.repeat(weights, n_windows)
        self.window_residual_: Any = clone(of_windows)
        self.window_residual_.fit(windows, np.repeat(y, n_windows), **metadata)

    def _residuals(self, X, rpm):
        windows, _, metadata = self._windows(X, rpm, self.window_residual_, "transform")
        of_windows = np.asarray(self.window_residual_.transform(windows, **metadata))
        of_windows = of_windows.reshape(len(X), -1, len(self.classes_))
        with np.errstate(divide="ignore"):
            residuals = np.exp(np.log(of_windows).mean(axis=1))
        if self.order_residual_ is not None:
            rows, speeds = _long_rows(X, rpm, self.order_residual_.sampling_rate)
            if len(rows) > 0:
                of_orders = self.order_residual_.transform(X[rows], rpm=speeds)
                residuals[rows] *= np.asarray(of_orders) ** self.order_weight
        return residuals

    def adapt(self, X: ArrayLike, y: ArrayLike, rpm: ArrayLike | None = None) -> Self:
        """Move the references of the windows by the smooth drift of rows at a new speed.

        Orders do not move with speed.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Innovations at the new speed.
        y : array-like of shape (n_rows,)
            Their conditions, among `classes_`. Usually all rows are healthy.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            The new speed, as in `fit`.

        Returns
        -------
        StretchResidual
            This transformer, for use at the new speed.

        Raises
        ------
        ValueError
            If a condition was not in `fit`.
        """
        X, y = self._validate(X, y)
        windows, n_windows, metadata = self._windows(
            X, rpm, self.window_residual_, "transform"
        )
        self.window_residual_.adapt(windows, np.repeat(y, n_windows), **metadata)
        return self

    def _windows(self, X, rpm, residual, method):
        """Return the windows of all rows, their number in a row, and their metadata.

        The windows of a row follow one another. The metadata is the mean speed of the
        row, for residuals that request it.
        """
        n_rows, n_models, n_samples = X.shape
        length = min(self.window_length, n_samples)
        count = n_samples // length
        metadata = {}
        if rpm is not None and requests(residual, method, "rpm"):
            metadata["rpm"] = np.repeat(np.exp(log_speeds(rpm, n_rows)), count)

        cut = X[..., : count * length].reshape(n_rows, n_models, count, length)
        windows = np.swapaxes(cut, 1, 2).reshape(-1, n_models, length)
        return windows, count, metadata

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_part("window_residual_")
        if self.order_residual_ is not None:
            self._check_part("order_residual_")

    def _check_parameters(self):
        check_real(self.order_weight, "order_weight", min_val=0)
        check_count(self.window_length, "window_length")
        check_scalar(self.order_residual, "order_residual", (OrderResidual, type(None)))

    def _capabilities(self):
        rate = self.order_residual.sampling_rate if self.order_residual else None
        of_orders = {
            "is_stretch": self.order_residual_ is not None,
            "compares_orders": self.order_residual_ is not None,
            "sampling_rate": rate,
        }
        return super()._capabilities() | of_orders


def _long_rows(X, rpm, sampling_rate):
    """Return the rows of at least three revolutions, and their speeds.

    These are all rows that show envelopes if nothing is known.
    """
    n_revolutions = np.inf if rpm is None and X.shape[-1] >= LEAST_SAMPLES else 0.0
    if sampling_rate is not None:
        speed = (
            _SUPPOSED_RPM
            if rpm is None
            else np.exp(log_speeds(rpm, len(X), X.shape[-1]))
        )
        n_revolutions = X.shape[-1] * speed / (60 * sampling_rate)
    rows = np.flatnonzero(np.broadcast_to(n_revolutions, len(X)) >= REVOLUTIONS_LEFT)
    return rows, None if rpm is None else speeds_of_rows(rpm, len(X))[rows]
