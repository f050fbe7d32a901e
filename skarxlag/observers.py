"""Proportional-integral observers: from innovations to residual levels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._observer_base import Observer
from ._validation import check_real
from .kernels import observer


class PIObserver(Observer):
    r"""Linear proportional-integral observer, the baseline (equations 17 and 18).

    With fault direction and output correction of the full-state observer chosen so that both
    reach the output through :math:`1/(z-\zeta)`, its output error e obeys a recursion on the
    innovations alone:

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \qquad
        \hat\delta^+ = \hat\delta + k_i e .

    With a = pole - kp it is stable if and only if a + ki < 1 and 2 (1 + a) + ki > 0 with ki > 0,
    or ki = 0 and -1 < a < 1 (Jury).

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`.
    ki : float, default=0.05
        Integral gain :math:`k_i`, at least 0.
    evaluation : {"power", "switching_gain", "whiteness"}, default="power"
        What is kept of a window's error e. "power": its root-mean-square. "switching_gain": the
        adapted gain of the sliding-mode residual, which settles at the median of the size of the
        sliding surface. "whiteness": the weighted cepstral norm of its log spectrum, that is how
        far the innovations are from white whatever their power (Mehra and Peschon 1971), with the
        observer's own response taken out.
    sliding_slope : float, default=10.0
        Slope :math:`\lambda` of the sliding surface, at least 0.
    adaptation_step : float, default=0.005
        Step of the logarithm of the switching gain a sample, in (0, 1].
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0; it shapes the
        residual that `observe` returns.
    spectrum_order : int, default=64
        Order of the network that takes the log spectrum for "whiteness", at least 1.
    quefrency_exponent : float, default=0.5
        Exponent p of the cepstral norm for "whiteness", from 0 to 10.
    fault_estimate : bool, default=False
        Whether the root-mean-square of each fault estimate is a further feature, for classifiers
        of other kinds: `ThresholdLadder` takes residuals alone.
    n_jobs : int or None, default=None
        Threads that work on windows. Results do not depend on it.

    Attributes
    ----------
    closed_loop_ : ndarray of shape (2, 2)
        The loop of correction and fault estimate.
    spectral_radius_ : float
        Largest modulus of its eigenvalues, of the correction alone where ki = 0.
    n_models_ : int
        Models that the innovations came from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    ExtendedStatePIObserver : Its gain grows with the fault.

    References
    ----------
    B. Shafai, S. Beale, H. H. Niemann and J. Stoustrup (1996), "LTR design of discrete-time
    proportional-integral observers", IEEE Transactions on Automatic Control 41(7), 1056-1062.

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

    closed_loop_: NDArray[Any]
    spectral_radius_: float

    def __init__(
        self,
        *,
        pole: float = 0.3,
        kp: float = 0.1,
        ki: float = 0.05,
        evaluation: str = "power",
        sliding_slope: float = 10.0,
        adaptation_step: float = 0.005,
        boundary_layer: float = 0.0,
        spectrum_order: int = 64,
        quefrency_exponent: float = 0.5,
        fault_estimate: bool = False,
        n_jobs: int | None = None,
    ) -> None:
        self.pole = pole
        self.kp = kp
        self.ki = ki
        self.evaluation = evaluation
        self.sliding_slope = sliding_slope
        self.adaptation_step = adaptation_step
        self.boundary_layer = boundary_layer
        self.spectrum_order = spectrum_order
        self.quefrency_exponent = quefrency_exponent
        self.fault_estimate = fault_estimate
        self.n_jobs = n_jobs

    def _certify(self):
        check_real(self.ki, "ki", min_val=0)
        self.closed_loop_ = observer.loop_matrix(self.pole, self.kp, self.ki)
        a = self.pole - self.kp
        states = self.closed_loop_ if self.ki > 0 else self.closed_loop_[:1, :1]
        self.spectral_radius_ = float(np.abs(np.linalg.eigvals(states)).max())
        if self.spectral_radius_ >= 1:
            raise ValueError(
                f"The observer is unstable with pole={self.pole}, kp={self.kp}, ki={self.ki}: "
                f"spectral radius {self.spectral_radius_:.6g}. Expected, with a = pole - kp = "
                f"{a:.6g}: a + ki < 1 (is {a + self.ki:.6g}) and 2 (1 + a) + ki > 0 (is "
                f"{2 * (1 + a) + self.ki:.6g})."
            )

    def _small_signal_gains(self):
        return self.pole, self.kp, self.ki

    def _loop_constants(self):
        return self.pole, self.kp, self.ki, 0.0, 1.0, 1.0, 0.0


class ExtendedStatePIObserver(Observer):
    r"""Extended-state proportional-integral observer, whose gain grows with the fault (Form A).

    Eq. (20) as printed feeds its estimate back twofold and diverges. Here the integrator is a
    state of its own and the square keeps its sign, which is A-1 and A-2 of the paper:

    .. math::

        p^+ = p + k_{Ia} e, \qquad S = p + k_{Ib} e, \qquad
        \hat\delta^+ = K_c\,(1 + \min(|S|, M)^\kappa)\, p^+,

    with :math:`e = \varepsilon - c` and :math:`c^+ = \zeta c + k_p e + \hat\delta` as in
    `PIObserver`. A constant fault is estimated without bias. S is in the unit of the innovations:
    the nonlinearity needs them in units of unit root-mean-square, or M in the sensor's unit.

    The gain from p to the estimate lies between :math:`K_c` and :math:`K_c(1 + M^\kappa)`. `fit`
    finds one quadratic Lyapunov function for the loops at both ends, which certifies every
    sequence of gains between them, or raises.

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`.
    ki_a : float, default=0.025
        Integral gain :math:`k_{Ia}`, above 0.
    ki_b : float, default=0.025
        Weight :math:`k_{Ib}` of the present error in S.
    gain : float, default=2.0
        Gain :math:`K_c`, above 0; the small-signal integral gain is ki_a times it.
    exponent : float, default=1.0
        Exponent :math:`\kappa`, above 0.
    saturation : float, default=1.0
        Bound M on the size of S, at least 0; at 0 the observer is linear.
    evaluation : {"power", "switching_gain", "whiteness"}, default="switching_gain"
        What is kept of a window's error e. "power": its root-mean-square. "switching_gain": the
        adapted gain of the sliding-mode residual, which settles at the median of the size of the
        sliding surface. "whiteness": the weighted cepstral norm of its log spectrum, that is how
        far the innovations are from white whatever their power (Mehra and Peschon 1971), with the
        observer's own response taken out.
    sliding_slope : float, default=10.0
        Slope :math:`\lambda` of the sliding surface, at least 0.
    adaptation_step : float, default=0.005
        Step of the logarithm of the switching gain a sample, in (0, 1].
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0; it shapes the
        residual that `observe` returns.
    spectrum_order : int, default=64
        Order of the network that takes the log spectrum for "whiteness", at least 1.
    quefrency_exponent : float, default=0.5
        Exponent p of the cepstral norm for "whiteness", from 0 to 10.
    fault_estimate : bool, default=False
        Whether the root-mean-square of each fault estimate is a further feature, for classifiers
        of other kinds: `ThresholdLadder` takes residuals alone.
    n_jobs : int or None, default=None
        Threads that work on windows. Results do not depend on it.

    Attributes
    ----------
    lyapunov_ : ndarray of shape (2, 2)
        The certificate: P with A'PA - P negative definite for both matrices of `closed_loops_`.
    closed_loops_ : ndarray of shape (2, 2, 2)
        The loop at the smallest and at the largest gain.
    n_models_ : int
        Models that the innovations came from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

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

    lyapunov_: NDArray[Any]
    closed_loops_: NDArray[Any]

    def __init__(
        self,
        *,
        pole: float = 0.3,
        kp: float = 0.1,
        ki_a: float = 0.025,
        ki_b: float = 0.025,
        gain: float = 2.0,
        exponent: float = 1.0,
        saturation: float = 1.0,
        evaluation: str = "switching_gain",
        sliding_slope: float = 10.0,
        adaptation_step: float = 0.005,
        boundary_layer: float = 0.0,
        spectrum_order: int = 64,
        quefrency_exponent: float = 0.5,
        fault_estimate: bool = False,
        n_jobs: int | None = None,
    ) -> None:
        self.pole = pole
        self.kp = kp
        self.ki_a = ki_a
        self.ki_b = ki_b
        self.gain = gain
        self.exponent = exponent
        self.saturation = saturation
        self.evaluation = evaluation
        self.sliding_slope = sliding_slope
        self.adaptation_step = adaptation_step
        self.boundary_layer = boundary_layer
        self.spectrum_order = spectrum_order
        self.quefrency_exponent = quefrency_exponent
        self.fault_estimate = fault_estimate
        self.n_jobs = n_jobs

    def _certify(self):
        check_real(self.ki_a, "ki_a")
        check_real(self.ki_b, "ki_b")
        for name in ("gain", "exponent"):
            check_real(getattr(self, name), name, min_val=0, include_boundaries="neither")
        check_real(self.saturation, "saturation", min_val=0)
        with np.errstate(over="ignore"):
            largest = self.gain * (1 + np.float64(self.saturation) ** self.exponent)
        if not np.isfinite(largest):
            raise ValueError(
                f"gain * (1 + saturation ** exponent) is not finite with gain={self.gain}, "
                f"saturation={self.saturation} and exponent={self.exponent}."
            )
        self.closed_loops_ = np.array(
            [observer.loop_matrix(self.pole, self.kp, self.ki_a, g) for g in (self.gain, largest)]
        )
        certificate = observer.common_lyapunov(*self.closed_loops_)
        if certificate is None:
            radii = np.abs(np.linalg.eigvals(self.closed_loops_)).max(axis=1)
            raise ValueError(
                "No common quadratic Lyapunov function certifies the observer with "
                f"pole={self.pole}, kp={self.kp}, ki_a={self.ki_a} and gains from {self.gain} to "
                f"{largest:.6g}: spectral radii {radii[0]:.6g} and {radii[1]:.6g}, expected below "
                "1 with room between; lower ki_a, gain or saturation."
            )
        self.lyapunov_ = certificate

    def _small_signal_gains(self):
        return self.pole, self.kp, self.ki_a * self.gain

    def _loop_constants(self):
        return (
            self.pole,
            self.kp,
            self.ki_a,
            self.ki_b,
            self.gain,
            self.exponent,
            self.saturation,
        )
