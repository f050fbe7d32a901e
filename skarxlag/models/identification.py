"""ARX-Laguerre identification: from windows to innovations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import Bunch, check_scalar

from ..core.base import ArrayTransformer, SignalEstimator
from ..core.fault_locations import expect_condition
from ..core.parallel import map_batches
from ..core.state import SQUARABLE, expect, is_fitted, uses_fitted
from ..core.validation import (
    UP_TO_1,
    check_flag,
    check_input_names,
    check_labels,
    check_real,
    validate_signals,
    weighted_windows,
)
from ..kernels import arx_laguerre
from ..kernels.laguerre import network_matrices, settling_length
from ..kernels.least_squares import solve_sums
from ..kernels.scaling import fit_percentage, unit_rms_windows
from .free_run import free_run_output
from .networks import check_same_networks, choose_networks
from .weighted_windows import windows_of_models

#: Name of a model of all windows.
_OF_ALL = "model"


@dataclass(kw_only=True, eq=False, repr=False)
class ARXLaguerre(SignalEstimator, ArrayTransformer, auto_wrap_output_keys=None):
    r"""Identify ARX-Laguerre models of windows and return what they cannot predict.

    The one-step prediction of the output is linear in the states of Laguerre networks,
    one on the output and one on each measured input (Eqs. 4 and 11 of Piltan and Kim
    2019, as repaired):

    .. math::

        x(k+1) = A x(k) + b_y y(k) + b_u u(k), \qquad \hat y_c(k) = g_c^T x(k), \qquad
        \varepsilon_c(k) = y(k) - \hat y_c(k).

    All conditions share the networks. Each condition c in `y` has its own coefficients
    :math:`g_c` (a residual bank), found by ridge least squares over the windows of that
    condition. Every window is first centred and divided by the root mean square of its
    output. The states start from zero in every window, so the samples in which the
    slowest network settles (`n_transient`, at most half a window) are dropped.

    `Laguerre` in SysIdentPy is a polynomial basis; here it is this orthonormal filter
    network.

    Parameters
    ----------
    order : int or sequence of int, default=32
        Number N of Laguerre filters, at least 1, and at most the samples of a window,
        or 64 if it has fewer. One number for all channels; two, of the output and of
        all inputs, if there are any; or one for each channel, output first.
    pole : float, "optimise" or a sequence of these, default=0.3
        Pole of the networks in (-1, 1), given like `order`. With 0 the model is a plain
        ARX model. "optimise" searches the pole with the smallest prediction error,
        summed over all models. `partial_fit` searches in its first call and keeps the
        poles.
    alpha : float, default=1e-6
        Ridge parameter, at least 0, which is added to the sum of squares. It
        corresponds to the start :math:`P_0 = I/\alpha` of recursive least squares.
    bank : bool, default=True
        Whether each condition in `y` has its own model. If False, there is one model of
        all windows.
    healthy : label or None, default=None
        Condition in `y`. If given, one model is identified, on the windows of this
        condition.
    unit_rms : bool, default=True
        Whether innovations are those of windows of unit root mean square. If False,
        they are in the sensor's unit, for detection by physical amplitude.
    forgetting_factor : float, default=1.0
        Factor in (0, 1] on the weight of a window for each later window of its
        condition.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_models,)
        The condition of each model, sorted; ["model"] for one model of all windows.
    coef_ : ndarray of shape (n_models, n_states)
        Fourier coefficients, those of the output's network first.
    orders_ : ndarray of shape (n_channels,)
        Order of each channel's network.
    poles_ : ndarray of shape (n_channels,)
        Pole of each channel's network.
    noise_level_ : ndarray of shape (n_models,)
        Root mean square of a model's innovations on its own windows of unit root mean
        square.
    sums_ : ndarray of shape (n_models, n_states + 1, n_states + 1)
        Sums of squares and products that `partial_fit` adds to.
    weights_ : ndarray of shape (n_models,)
        Weighted number of samples in each model's sums.
    n_features_in_ : int
        Number of samples in a window, or of channels if windows have several.
    window_shape_ : ndarray of int
        Shape of a window in `fit`. Later windows of several channels may have another
        length: at least twice the `n_transient` of `fit`.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    PIObserver : Turns innovations into residual levels.

    References
    ----------
    F. Piltan and J.-M. Kim (2019), "Nonlinear Extended-state ARX-Laguerre PI Observer
    Fault Diagnosis of Bearings", Applied Sciences 9(5), 888.

    K. Bouzrara, T. Garna, J. Ragot and H. Messaoud (2012), "Decomposition of an ARX
    model on Laguerre orthonormal bases", ISA Transactions 51, 848-860.

    Examples
    --------
    A known system, recovered from its output and its input:

    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> rng = np.random.default_rng(0)
    >>> u = rng.normal(size=12_000)
    >>> y = lfilter([0, 0.5, 0.3], [1, -1.5, 0.7], u)   # y(k) = 1.5 y(k-1) - 0.7 y(k-2) + ...
    >>> windows = np.stack([y.reshape(10, 1200), u.reshape(10, 1200)], axis=1)
    >>> model = ARXLaguerre(order=2, pole=0.0).fit(windows)
    >>> model.coef_.round(3)
    array([[ 1.5, -0.7,  0.5,  0.3]])
    >>> model.transform(windows).shape
    (10, 1, 1198)
    """

    order: int | Sequence[int] = 32
    pole: float | str | Sequence[float | str] = 0.3
    alpha: float = 1e-6
    bank: bool = True
    healthy: Any = None
    unit_rms: bool = True
    forgetting_factor: float = 1.0
    n_jobs: int | None = None

    #: Metadata routing hands weights over without a call of `set_fit_request`.
    __metadata_request__fit: ClassVar = {"sample_weight": True}

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Identify the models.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows; of several channels the output is the first.
        y : array-like of shape (n_windows,) or None, default=None
            Condition of each window. None: all windows belong to one model.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            Weight of each window in the sums, at least 0. A window of weight 2 counts
            as two windows, one of weight 0 as none. None: all weigh 1.

        Returns
        -------
        ARXLaguerre
            The fitted estimator.

        Raises
        ------
        ValueError
            If a parameter is out of its range, `healthy` is not in `y`, or a weight is
            negative.
        TypeError
            If a parameter is of another type.
        """
        return self._identify(X, y, sample_weight, start_afresh=True)

    def partial_fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Add windows to the sums and solve again.

        Parameters
        ----------
        X, y, sample_weight : array-like
            Further windows, their conditions and their weights, as in `fit`. A
            condition not seen before gets a model. A window fades once with each later
            window, whatever their weights.

        Returns
        -------
        ARXLaguerre
            The fitted estimator, with the coefficients of one `fit` on all windows so
            far.

        Raises
        ------
        ValueError
            As in `fit`; also if `order` or `pole` are not those of the models so far.
        """
        return self._identify(
            X, y, sample_weight, start_afresh=not is_fitted(self, "sums_")
        )

    def _identify(self, X, y, sample_weight, *, start_afresh):
        windows, y = self._validate_windows(X, y, reset=start_afresh)
        if not start_afresh:
            self._check_conditions_go_on(y)
            self._check_relations()
        windows, y, weights = weighted_windows(windows, y, sample_weight)
        windows, labels, weights = self._windows_by_model(windows, y, weights)
        self._check_parameters()
        models = windows_of_models(
            windows, labels, weights, merge=self.forgetting_factor == 1
        )
        if start_afresh:
            orders, poles = choose_networks(
                self.order, self.pole, [*models.values()], self.alpha, self.n_jobs
            )
            self.orders_: NDArray[Any] = orders
            self.poles_: NDArray[Any] = poles
            self.classes_: NDArray[Any] = labels[:0]
            self.sums_: NDArray[Any] = np.empty(0)
            self.weights_: NDArray[Any] = np.empty(0)
        check_labels([*self.classes_.tolist(), *models])
        self._add_to_sums(models, labels)
        solutions = [solve_sums(sums, self.alpha) for sums in self.sums_]
        self.coef_: NDArray[Any] = np.array([coef for coef, _ in solutions])
        errors = np.array([error for _, error in solutions])
        n_counted = np.where(self.weights_ > 0, self.weights_, 1.0)
        self.noise_level_: NDArray[Any] = np.sqrt(errors / n_counted)
        return self

    def _add_to_sums(self, models, labels):
        """Add the windows of each model to its sums, in which older windows fade."""
        so_far = zip(self.sums_, self.weights_, strict=True)
        of_models = dict(zip(self.classes_.tolist(), so_far, strict=True))
        for name, weighted in models.items():
            n_transient = self._n_transient(weighted.windows.shape[-1])
            faded = weighted.faded(self.forgetting_factor)
            more_sums, more_weight = faded.sums_of_products(
                self.orders_, self.poles_, n_transient, self.n_jobs
            )
            sums, weight = of_models.get(name, (0.0, 0.0))
            kept = self.forgetting_factor ** len(weighted.rows)
            of_models[name] = kept * sums + more_sums, kept * weight + more_weight
        self.classes_ = np.union1d(self.classes_, labels)
        in_order = [of_models[name] for name in self.classes_.tolist()]
        self.sums_ = np.array([sums for sums, _ in in_order])
        self.weights_ = np.array([weight for _, weight in in_order])

    def _check_parameters(self):
        check_flag(self.bank, "bank")
        check_flag(self.unit_rms, "unit_rms")
        check_real(self.alpha, "alpha", min_val=0)
        check_real(self.forgetting_factor, "forgetting_factor", **UP_TO_1)

    def _check_conditions_go_on(self, y):
        """Check that `y` is None if and only if the models so far were fitted without it."""
        is_of_all = self.classes_.tolist() == [_OF_ALL]
        if self.bank and self.healthy is None:
            expected = f"conditions, as those so far: {self.classes_}"
            if is_of_all:
                expected = "None"
            goes_on = (y is None) == is_of_all
            expect(goes_on, "y", y, f"{expected}; call fit to start afresh")

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """Compute the innovations of every model on every window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.

        Returns
        -------
        ndarray of shape (n_windows, n_models, n_samples - n_transient)
            Innovations of windows of unit root mean square or, with ``unit_rms=False``,
            in the sensor's unit.
        """
        windows, _ = self._validate_windows(X, None, reset=False)
        return self._innovations(windows, self.unit_rms)

    def _innovations(self, windows, unit_rms):
        n_windows, _, n_samples = windows.shape
        n_transient = self._n_transient(n_samples)
        shape = (n_windows, len(self.coef_), n_samples - n_transient)
        innovations = np.empty(shape, dtype=windows.dtype)
        models = (self.orders_, self.poles_, self.coef_)

        def of_batch(batch):
            scaled, rms = unit_rms_windows(windows[batch])
            of_windows = innovations[batch]
            arx_laguerre.innovations(scaled, *models, n_transient, of_windows)
            if not unit_rms:
                of_windows *= rms[:, np.newaxis, np.newaxis]

        map_batches(of_batch, n_windows, self.n_jobs)
        return innovations

    @uses_fitted
    def state_space(self) -> Bunch:
        """Return the networks and the coefficients as one state-space model.

        Returns
        -------
        Bunch
            ``A`` of shape (n_states, n_states), ``b_y`` of shape (n_states,), ``b_u``
            of shape (n_states, n_inputs), shared by all models, and ``coef`` of shape
            (n_models, n_states). All of them apply to centred windows.
        """
        A, b = network_matrices(self.orders_, self.poles_)
        return Bunch(A=A, b_y=b[:, 0], b_u=b[:, 1:], coef=self.coef_)

    @uses_fitted
    def predict_output(self, X: ArrayLike, *, free_run: bool = False) -> NDArray[Any]:
        """Predict the output with every model, in the sensor's unit.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        free_run : bool, default=False
            If False, predict each sample from all measured samples before it. If True,
            simulate the output from the inputs and from the samples of the transient.

        Returns
        -------
        ndarray of shape (n_windows, n_models, n_samples - n_transient)
            Predicted output, with the mean of the window's output.

        Raises
        ------
        ValueError
            If `free_run` is True and a model is unstable when it is fed its own output.
        """
        windows, _ = self._validate_windows(X, None, reset=False)
        windows = windows.astype(np.float64, copy=False)
        n_transient = self._n_transient(windows.shape[-1])
        if not free_run:
            errors = self._innovations(windows, unit_rms=False)
            return windows[:, :1, n_transient:] - errors
        models = (self.orders_, self.poles_, self.coef_, self.classes_)
        return free_run_output(windows, *models, n_transient)

    def fit_percentage(self, X: ArrayLike, *, free_run: bool = False) -> NDArray[Any]:
        r"""Compute the fit of each model to each window, as usual in system identification.

        The fit is :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)` over the samples
        after the transient. It is 100 for an exact prediction, 0 for one that is no
        better than the mean, and negative for a worse one.

        Parameters
        ----------
        X, free_run : array-like and bool
            Windows, and whether to simulate, as in `predict_output`.

        Returns
        -------
        ndarray of shape (n_windows, n_models)
            Percentages; 100 for a window whose output is constant.
        """
        predicted = self.predict_output(X, free_run=free_run)
        windows, _ = self._validate_windows(X, None, reset=False)
        return fit_percentage(windows[:, :1, -predicted.shape[-1] :], predicted)

    @uses_fitted
    def get_feature_names_out(
        self, input_features: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Return the name of each model, which is its condition.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Compared with the names of `fit`. The names of the models do not depend on
            it.

        Returns
        -------
        ndarray of str of shape (n_models,)
            Names along axis 1 of the output of `transform`.
        """
        check_input_names(self, input_features)
        return np.array([str(name) for name in self.classes_], dtype=object)

    def _validate_windows(self, X, y, *, reset):
        X, y = validate_signals(self, X, y, reset=reset, any_length=True)
        windows = X[:, np.newaxis] if X.ndim == 2 else X
        expected = "(n_windows, 1 + n_inputs, n_samples); transpose the last two axes"
        expect(windows.shape[1] <= windows.shape[2], "X.shape", X.shape, expected)
        if not reset:
            least = 2 * self._n_transient(int(self.window_shape_[-1]))
            # In shorter ones, the networks do not settle as in `fit`.
            check_scalar(
                windows.shape[2], "Samples in a window of X", int, min_val=least
            )
        return windows, y

    def _windows_by_model(self, windows, y, weights):
        """Return the windows to identify on, the name of each one's model, and the weights."""
        if self.healthy is not None:
            is_healthy = y == self.healthy
            expect_condition(self.healthy, np.unique(y).tolist())
            return windows[is_healthy], y[is_healthy], weights[is_healthy]
        if y is None or not self.bank:
            return windows, np.full(len(windows), _OF_ALL), weights
        return windows, y, weights

    def _n_transient(self, n_samples):
        settled = max(map(settling_length, self.orders_.tolist(), self.poles_.tolist()))
        return min(settled, n_samples // 2)

    def _check_fitted(self):
        super()._check_fitted()
        self._check_array("orders_", (self._n_channels,), "at least 1", int)
        self._check_array("poles_", self.orders_.shape, "above -1 and below 1")
        self._check_classes()
        n_models = len(self.classes_)
        n_states = self.orders_.sum()
        self._check_array("noise_level_", (n_models,), "at least 0")
        self._check_array("weights_", (n_models,), "at least 0")
        self._check_array("coef_", (n_models, n_states), SQUARABLE)
        self._check_array("sums_", (n_models, n_states + 1, n_states + 1))
        # They follow from an equation, so those of a state at rest are 0 but for
        # rounding.
        squares = np.einsum("mii->mi", self.sums_)
        are_squares = squares >= -1e-6 * np.abs(self.sums_).max()
        expected = "sums of squares, at least 0, on the diagonal"
        expect(are_squares, "sums_", self.sums_, expected)

    def _check_relations(self):
        check_same_networks(self.order, self.pole, self.orders_, self.poles_)
