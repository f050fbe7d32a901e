"""Proportional-integral observers: from innovations to residual levels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.utils import Bunch

from ..core.base import InnovationsTransformer
from ..core.parallel import BATCH, map_batches
from ..core.state import expect, uses_fitted
from ..core.validation import (
    ABOVE_0,
    UP_TO_1,
    WITHIN_1,
    check_count,
    check_real,
    validate_innovations,
)
from ..kernels import observer, residual_levels
from ..kernels.lanes import LANES
from .residual_evaluations import RESIDUAL_EVALUATIONS


@dataclass(kw_only=True, eq=False, repr=False)
class Observer(InnovationsTransformer):
    """Transformer from innovations to residual levels by a recursion on the innovations.

    A subclass checks its gains in `_certify`, and returns the parameters of the
    compiled loop in `_loop`, see `skarxlag.kernels.observer.observe`.
    """

    pole: float = 0.3
    kp: float = 0.1
    evaluation: str = "power"
    sliding_slope: float = 10.0
    adaptation_step: float = 0.005
    boundary_layer: float = 0.0
    spectrum_order: int = 64
    n_jobs: int | None = None

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """Compute one residual level for each window and model.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        ndarray of shape (n_windows, n_models)
            Residual levels.
        """
        innovations, _ = validate_innovations(self, X, reset=False)

        def of_batch(batch):
            rows = np.require(
                innovations[batch], dtype=np.float64, requirements=["C", "W"]
            )
            return RESIDUAL_EVALUATIONS[self.evaluation].levels(rows, self)

        # The trajectories of a batch stay in the processor's caches.
        together = max(LANES, BATCH // innovations.shape[1])
        parts = map_batches(of_batch, len(innovations), self.n_jobs, together)
        return np.concatenate(parts).astype(innovations.dtype, copy=False)

    @uses_fitted
    def observe(self, X: ArrayLike) -> Bunch:
        r"""Compute the trajectories that the levels are made of.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        Bunch
            Arrays with the shape and unit of X: ``error`` e, ``fault_estimate`` before
            each sample, ``sliding_surface`` :math:`S = \lambda e + (e(k) - e(k-1))`,
            ``switching_gain`` K_s, and ``residual``, :math:`r = K_s\,\mathrm{sgn}(S)`
            or, with a boundary layer, :math:`r = K_s\,\mathrm{sat}(S / (\phi K_s))`.
        """
        innovations, _ = validate_innovations(self, X, reset=False)
        shape = np.shape(X)
        innovations = np.require(innovations, dtype=np.float64, requirements=["C", "W"])
        paths = observer.observe(innovations, self._loop())
        error, fault_estimate = (path.reshape(-1, shape[-1]) for path in paths)
        surface = residual_levels.sliding_surface(error, self.sliding_slope)
        gain = residual_levels.switching_gain(surface, self.adaptation_step)
        layer = self.boundary_layer * gain
        saturated = np.divide(surface, layer, out=np.sign(surface), where=layer > 0)
        trajectories = {
            "error": error,
            "fault_estimate": fault_estimate,
            "sliding_surface": surface,
            "switching_gain": gain,
            "residual": gain * np.clip(saturated, -1, 1),
        }
        return Bunch(
            **{name: path.reshape(shape) for name, path in trajectories.items()}
        )

    @uses_fitted
    def get_feature_names_out(
        self, input_features: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Return the names of the levels, made of model and evaluation.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the models, as `ARXLaguerre.get_feature_names_out` returns them.

        Returns
        -------
        ndarray of str
            One name for each column of the output of `transform`.
        """
        prefixes = self._model_prefixes(input_features, least=1)
        return np.array([prefix + self.evaluation for prefix in prefixes], dtype=object)

    def _check_parameters(self):
        check_real(self.pole, "pole", **WITHIN_1)
        check_real(self.kp, "kp")
        names = [*RESIDUAL_EVALUATIONS]
        is_name = str(self.evaluation) in names
        expect(is_name, "evaluation", self.evaluation, f"one of {names}")
        check_real(self.sliding_slope, "sliding_slope", min_val=0)
        check_real(self.adaptation_step, "adaptation_step", **UP_TO_1)
        check_real(self.boundary_layer, "boundary_layer", min_val=0)
        check_count(self.spectrum_order, "spectrum_order")

    def _check_relations(self):
        # The loops run on the parameters, and all that `fit` stores follows from these.
        certified = clone(self)
        certified._certify()
        for name in vars(certified).keys() - self.get_params(deep=False).keys():
            expected = getattr(certified, name)
            stored = getattr(self, name)
            follows = np.allclose(stored, expected, rtol=1e-6)
            expect(follows, name, stored, f"{expected!r}, as the parameters give")


@dataclass(kw_only=True, eq=False, repr=False)
class PIObserver(Observer):
    r"""Linear proportional-integral observer, the baseline (equations 17 and 18).

    With fault direction and output correction of the full-state observer chosen so that
    both reach the output through :math:`1/(z-\zeta)`, its output error e obeys a
    recursion on the innovations alone:

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \qquad
        \hat\delta^+ = \hat\delta + k_i e .

    With a = pole - kp it is stable if and only if a + ki < 1 and 2 (1 + a) + ki > 0
    with ki > 0, or ki = 0 and -1 < a < 1 (Jury).

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`, any for which the observer is stable.
    ki : float, default=0.05
        Integral gain :math:`k_i`, at least 0.
    evaluation : {"power", "switching_gain", "whiteness"}, default="power"
        Residual level of a window, computed from its error e. "power": the root mean
        square of e. "switching_gain": the adapted gain of the sliding-mode residual,
        which settles at the median size of the sliding surface. "whiteness": the
        weighted cepstral norm of the log spectrum of e, that is its distance from white
        noise of any power (Mehra and Peschon 1971). The observer's own response is
        removed.
    sliding_slope : float, default=10.0
        Slope :math:`\lambda` of the sliding surface, at least 0.
    adaptation_step : float, default=0.005
        Step of the logarithm of the switching gain per sample, in (0, 1].
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0. It
        affects the residual that `observe` returns, and no level.
    spectrum_order : int, default=64
        Order of the autoregressive model whose log spectrum is used for "whiteness", at
        least 1.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    closed_loop_ : ndarray of shape (2, 2)
        Closed loop of correction and fault estimate.
    spectral_radius_ : float
        Largest modulus of its eigenvalues. If ki = 0, that of the correction alone.
    n_models_ : int
        Number of models that the innovations are from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    ExtendedStatePIObserver : Its gain grows with the fault.

    References
    ----------
    B. Shafai, S. Beale, H. H. Niemann and J. Stoustrup (1996), "LTR design of
    discrete-time proportional-integral observers", IEEE Transactions on Automatic
    Control 41(7), 1056-1062.

    Examples
    --------
    A constant fault on white innovations is estimated without bias:

    >>> import numpy as np
    >>> observer = PIObserver(pole=0.0, kp=0.2, ki=0.05)
    >>> fault = np.full((1, 400), 0.5)
    >>> innovations = np.concatenate([np.zeros((1, 1)), fault], axis=1)
    >>> estimate = observer.fit(innovations).observe(innovations).fault_estimate
    >>> round(float(estimate[0, -1]), 6)
    0.5
    """

    ki: float = 0.05

    def _certify(self):
        check_real(self.ki, "ki", min_val=0)
        self.closed_loop_: NDArray[Any] = self._closed_loop()
        states = self.closed_loop_ if self.ki > 0 else self.closed_loop_[:1, :1]
        radius = float(np.abs(np.linalg.eigvals(states)).max())
        if not radius < 1:
            raise ValueError(
                f"The observer is unstable: with pole={self.pole}, kp={self.kp} and "
                f"ki={self.ki}, its spectral radius is {radius:.6g}. Reduce ki or kp, so that "
                "pole - kp + ki < 1 and 2 (1 + pole - kp) + ki > 0."
            )
        self.spectral_radius_: float = radius

    def _check_fitted(self):
        super()._check_fitted()
        self._check_array("closed_loop_", (2, 2))
        is_given = _are_close(self.closed_loop_, self._closed_loop())
        expected = "the loop that the parameters give"
        expect(is_given, "closed_loop_", self.closed_loop_, expected)
        self._check_number("spectral_radius_", "at least 0 and below 1")

    def _closed_loop(self):
        return observer.loop_matrix(self.pole, self.kp, self.ki)

    def _loop(self):
        return float(self.pole), float(self.kp), float(self.ki), 0.0, 1.0, 1.0, 0.0


@dataclass(kw_only=True, eq=False, repr=False)
class ExtendedStatePIObserver(Observer):
    r"""Extended-state proportional-integral observer, whose gain grows with the fault (Form A).

    Eq. (20) as printed feeds its estimate back twofold and diverges. Here the
    integrator is a state of its own and the square keeps its sign, which is A-1 and A-2
    of the paper:

    .. math::

        p^+ = p + k_{Ia} e, \qquad S = p + k_{Ib} e, \qquad
        \hat\delta^+ = K_c\,(1 + \min(|S|, M)^\kappa)\, p^+,

    with :math:`e = \varepsilon - c` and :math:`c^+ = \zeta c + k_p e + \hat\delta` as
    in `PIObserver`. A constant fault is estimated without bias. S is in the unit of the
    innovations: the nonlinearity needs them in units of unit root-mean-square, or M in
    the sensor's unit.

    The gain from p to the estimate lies between :math:`K_c` and :math:`K_c(1 +
    M^\kappa)`. `fit` finds one quadratic Lyapunov function for the loops at both ends,
    which certifies every sequence of gains between them, or raises.

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`, any for which the observer is certified.
    ki_a : float, default=0.025
        Integral gain :math:`k_{Ia}`, above 0.
    ki_b : float, default=0.025
        Weight :math:`k_{Ib}` of the present error in S, any finite number.
    gain : float, default=2.0
        Gain :math:`K_c`, above 0; the small-signal integral gain is ki_a times it.
    exponent : float, default=1.0
        Exponent :math:`\kappa`, above 0.
    saturation : float, default=1.0
        Bound M on the size of S, at least 0; at 0 the observer is linear.
    evaluation : {"power", "switching_gain", "whiteness"}, default="switching_gain"
        As in `PIObserver`.
    sliding_slope : float, default=10.0
        As in `PIObserver`.
    adaptation_step : float, default=0.005
        As in `PIObserver`.
    boundary_layer : float, default=0.0
        As in `PIObserver`.
    spectrum_order : int, default=64
        As in `PIObserver`.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    lyapunov_ : ndarray of shape (2, 2)
        Certificate P: A'PA - P is negative definite for both matrices A of
        `closed_loops_`.
    closed_loops_ : ndarray of shape (2, 2, 2)
        Closed loop at the smallest and at the largest gain.
    n_models_ : int
        Number of models that the innovations are from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    PIObserver : The linear observer.

    Examples
    --------
    >>> import numpy as np
    >>> innovations = np.random.default_rng(0).normal(size=(3, 2, 500))
    >>> ExtendedStatePIObserver().fit_transform(innovations).shape
    (3, 2)
    >>> ExtendedStatePIObserver(ki_a=2.0).fit(innovations)
    Traceback (most recent call last):
        ...
    ValueError: No common quadratic Lyapunov function certifies the observer with pole=0.3, ...
    """

    ki_a: float = 0.025
    ki_b: float = 0.025
    gain: float = 2.0
    exponent: float = 1.0
    saturation: float = 1.0
    evaluation: str = "switching_gain"

    def _certify(self):
        check_real(self.ki_a, "ki_a", **ABOVE_0)
        check_real(self.ki_b, "ki_b")
        check_real(self.gain, "gain", **ABOVE_0)
        check_real(self.exponent, "exponent", **ABOVE_0)
        check_real(self.saturation, "saturation", min_val=0)
        largest = self._largest_gain()
        check_real(largest, "gain * (1 + saturation ** exponent)")
        self.closed_loops_: NDArray[Any] = self._closed_loops()
        certificate = observer.common_lyapunov(*self.closed_loops_)
        if certificate is None:
            radii = np.abs(np.linalg.eigvals(self.closed_loops_)).max(axis=1)
            raise ValueError(
                "No common quadratic Lyapunov function certifies the observer with "
                f"pole={self.pole}, kp={self.kp}, ki_a={self.ki_a} and gains from {self.gain} to "
                f"{largest:.6g}. Its spectral radii are {radii[0]:.3g} and {radii[1]:.3g} and must "
                "be well below 1. Reduce ki_a, gain or saturation."
            )
        self.lyapunov_: NDArray[Any] = certificate

    def _check_fitted(self):
        super()._check_fitted()
        self._check_array("closed_loops_", (2, 2, 2))
        are_given = _are_close(self.closed_loops_, self._closed_loops())
        expected = "the loops that the parameters give"
        expect(are_given, "closed_loops_", self.closed_loops_, expected)
        self._check_array("lyapunov_", (2, 2))

    def _largest_gain(self):
        with np.errstate(over="ignore"):
            return self.gain * (1 + np.float64(self.saturation) ** self.exponent)

    def _closed_loops(self):
        gains = (self.gain, self._largest_gain())
        loops = [
            observer.loop_matrix(self.pole, self.kp, self.ki_a, gain) for gain in gains
        ]
        return np.array(loops)

    def _loop(self):
        gains = self.ki_a, self.ki_b, self.gain, self.exponent, self.saturation
        return tuple(map(float, (self.pole, self.kp, *gains)))


def _are_close(stored, expected):
    return np.abs(stored - expected).max() <= 1e-6 * np.abs(expected).max()
