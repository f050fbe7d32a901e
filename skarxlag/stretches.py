"""Residuals of stretches: the colour of the windows in them, times the orders of the shaft."""

from __future__ import annotations

from numbers import Integral
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.pipeline import Pipeline
from sklearn.utils import check_scalar

from ._base import StretchTransformer
from ._validation import (
    INNOVATIONS,
    Labels,
    remember_parameters,
    uses_fitted,
    validate_innovations,
    weighted_windows,
)
from .comparison import SpectralDistance
from .orders import OrderResidual
from .pipelines import DiagnosisPipeline
from .spectra import LogSpectra


def window_comparison(n_jobs: int | None = None) -> DiagnosisPipeline:
    """What `make_diagnoser` makes of innovations before it decides.

    Parameters
    ----------
    n_jobs : int or None, default=None
        Threads that work on windows.

    Returns
    -------
    DiagnosisPipeline
        Steps "measure" and "compare".
    """
    steps = [
        ("measure", LogSpectra(n_jobs=n_jobs)),
        ("compare", SpectralDistance(joint_weight=0.5, joint_groups=(0, 2))),
    ]
    return DiagnosisPipeline(steps, n_jobs=n_jobs)


def order_comparison(diagnoser: Pipeline) -> tuple[Pipeline | None, OrderResidual]:
    """Return what of a fitted pipeline compares order spectra, and what comes before it.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted.

    Returns
    -------
    before : Pipeline or None
        The steps whose results are compared; None if the first step compares.
    residual : OrderResidual
        The residual of order spectra, also where it is part of a `StretchResidual`.

    Raises
    ------
    ValueError
        If no step compares order spectra.
    """
    for place, (_, step) in enumerate(diagnoser.steps):
        residual = getattr(step, "order_residual_", step)
        if isinstance(residual, OrderResidual):
            return diagnoser[:place] if place > 0 else None, residual
    raise ValueError(
        "No step compares order spectra; expected a StretchResidual or an OrderResidual among "
        f"{[type(step).__name__ for _, step in diagnoser.steps]}."
    )


class StretchResidual(StretchTransformer):
    r"""Residual of a stretch: that of its windows times that of its order spectra.

    A stretch is a part of a recording that holds several turns of the shaft. Two things tell its
    condition, and a change of speed does not disturb both alike: the colour and the steadiness of
    the innovations, which a residual of *windows* compares with those of each condition, and the
    orders of the shaft at which strikes come, which `OrderResidual` compares. The residual of
    condition c is

    .. math::

        r_c = \Bigl(\prod_{w=1}^{m} r_{c,w}\Bigr)^{1/m} (r_c^{\mathrm{orders}})^q

    with :math:`r_{c,w}` the residual of window w of the m windows that fit into the stretch. The
    exponent q is 1 where the speed is given and 1/2 where it is not, since a pattern of strikes
    that is known only up to its scale tells less.

    The speed of each stretch comes as the metadata `rpm`, which this estimator requests; see
    `OrderResidual` for what happens without it.

    Parameters
    ----------
    window_residual : estimator or None, default=None
        Gives a residual for each window and condition, and may have a method `adapt`. None stands
        for `LogSpectra` and `SpectralDistance` as `make_diagnoser` has them.
    order_residual : OrderResidual or None, default=None
        None stands for ``OrderResidual()``, which knows no sampling rate, so that `rpm` cannot be
        given.
    window_length : int, default=4800
        Samples in a window, at least 1. A stretch that is shorter is one window.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    window_residual_ : estimator
        The fitted residual of windows.
    order_residual_ : OrderResidual
        The fitted residual of order spectra.
    window_shape_ : ndarray of int
        Shape of one training stretch.
    n_models_ : int
        Models that the innovations came from; 0 for plain stretches.
    n_features_in_ : int
        Number of models, or samples in a plain stretch.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(12, 20_000))
    >>> X[6:, ::1_000] += 20                          # a strike every tenth of a second
    >>> y = np.repeat(["good", "worn"], 6)
    >>> residual = StretchResidual(order_residual=OrderResidual(sampling_rate=10_000))
    >>> residual.fit(X, y, rpm=600).transform(X, rpm=600).argmin(axis=1)
    array([0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1])
    """

    classes_: NDArray[Any]
    window_residual_: Any
    order_residual_: OrderResidual

    _suffix = "stretch"

    _state = INNOVATIONS | {"classes_": Labels()}

    def __init__(
        self,
        *,
        window_residual: Any = None,
        order_residual: OrderResidual | None = None,
        window_length: int = 4800,
    ) -> None:
        self.window_residual = window_residual
        self.order_residual = order_residual
        self.window_length = window_length

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Calibrate both residuals.

        Parameters
        ----------
        X : array-like of shape (n_stretches, n_models, n_samples) or (n_stretches, n_samples)
            Innovations of one model, or of one model for each condition in `y`, sorted; or plain
            stretches.
        y : array-like of shape (n_stretches,)
            Condition of each stretch.
        rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples), default=None
            Nominal speed in revolutions per minute.
        sample_weight : array-like of shape (n_stretches,) or None, default=None
            How many stretches each one stands for, at least 0; its windows count as often. None:
            one each. A residual of windows that is given must take weights, too.

        Returns
        -------
        StretchResidual
            The fitted transformer.

        Raises
        ------
        ValueError
            As in `OrderResidual.fit`, and as the residual of windows raises it.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        self.classes_ = np.unique(weighted_windows(y, None, sample_weight)[0])
        orders = OrderResidual() if self.order_residual is None else self.order_residual
        self.order_residual_ = clone(orders).fit(X, y, rpm=rpm, sample_weight=sample_weight)
        windows = self._windows(X)
        n_windows = len(windows) // len(X)
        # A residual of windows that knows no weights serves where there are none.
        metadata = {}
        if sample_weight is not None:
            metadata["sample_weight"] = np.repeat(np.asarray(sample_weight), n_windows)
        of_windows = self.window_residual or window_comparison()
        self.window_residual_ = clone(of_windows).fit(windows, np.repeat(y, n_windows), **metadata)
        remember_parameters(self)
        return self

    @uses_fitted
    def transform(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """One residual for each stretch and condition.

        Parameters
        ----------
        X : array-like of shape (n_stretches, n_models, n_samples) or (n_stretches, n_samples)
            Innovations, or plain stretches.
        rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples), default=None
            Nominal speed in revolutions per minute.

        Returns
        -------
        ndarray of shape (n_stretches, n_classes)
            Products of both residuals.

        Raises
        ------
        ValueError
            As in `OrderResidual.transform`.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        windows = self._windows(X)
        of_windows = np.asarray(self.window_residual_.transform(windows))
        of_windows = of_windows.reshape(len(X), -1, len(self.classes_))
        with np.errstate(divide="ignore"):
            mean = np.exp(np.log(of_windows).mean(axis=1))
        of_orders = np.asarray(self.order_residual_.transform(X, rpm=rpm))
        return mean * (of_orders if rpm is not None else np.sqrt(of_orders))

    def adapt(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Move the references of the windows by what stretches of a new speed show.

        Orders do not move with speed.

        Parameters
        ----------
        X : array-like of shape (n_stretches, n_models, n_samples) or (n_stretches, n_samples)
            Innovations at the new speed.
        y : array-like of shape (n_stretches,)
            Their conditions, among `classes_`; commonly all healthy.

        Returns
        -------
        StretchResidual
            This transformer, for use at the new speed.

        Raises
        ------
        ValueError
            If a condition was not in `fit`.
        """
        X, y = validate_innovations(self, X, y, reset=False, any_length=True)
        windows = self._windows(X)
        self.window_residual_.adapt(windows, np.repeat(y, len(windows) // len(X)))
        return self

    @property
    def speed_known_(self) -> bool:
        """Whether `fit` was given `rpm`."""
        return self.order_residual_.speed_known_

    def _windows(self, X):
        """Windows of all stretches, those of a stretch one after another."""
        n_stretches, n_models, n_samples = X.shape
        length = min(self.window_length, n_samples)
        count = n_samples // length
        cut = X[..., : count * length].reshape(n_stretches, n_models, count, length)
        return np.swapaxes(cut, 1, 2).reshape(-1, n_models, length)

    def _check_parameters(self):
        check_scalar(self.window_length, "window_length", Integral, min_val=1)

    def _answers(self):
        return {
            "takes_rpm": self.speed_known_,
            "is_stretch": True,
            "sampling_rate": self.order_residual_.sampling_rate,
        }

    def _check_relations(self):
        for name in ("window_residual_", "order_residual_"):
            part = vars(self).get(name)
            try:
                agrees = np.array_equal(part.classes_, self.classes_)
            except AttributeError:
                agrees = False
            if not agrees:
                raise ValueError(
                    f"{name} == {part!r}, expected a fitted residual of the conditions "
                    f"{self.classes_.tolist()}."
                )
