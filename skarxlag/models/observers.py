"""Proportional-integral observers: from innovations to residuals."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.validation import check_real
from .observer_base import Observer


@dataclass(kw_only=True, eq=False, repr=False)
class ExtendedStatePIObserver(Observer):
    r"""Observers whose gain grows with the fault: the paper's proposal, repaired.

    The paper's fault is a vector. One observer of one output can estimate one component
    of it, so a vector takes one observer for each component. Observer m of M estimates
    the component at the frequency :math:`\omega_m = \pi (m + 1/2) / M`. Its output
    error e, its integral p and its fault estimate :math:`\hat\delta` obey a recursion
    on the innovations :math:`\varepsilon` alone (A-1 and A-2 of the paper, Form A):

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \qquad
        p^+ = p + k_i e, \qquad \hat\delta^+ = (1 + \min(|p^+|, M_m))\,p^+ .

    Eq. (20) as printed feeds its estimate back twofold and diverges. Here the
    integrator is a state of its own and the square keeps its sign. A constant fault is
    estimated without bias. Innovations of several models count by their mean, which are
    those of the mean model.

    *Gains.* `kp` and `ki` are those of one observer of a constant fault. For small
    faults the slowest pole of its loop has the modulus :math:`\rho`. In a bank, the
    poles of observer m are :math:`\rho\,e^{\pm j\omega_m}`, so all observers settle
    equally fast:

    .. math::

        k_{p,m} = 1 + \zeta - 2\rho\cos\omega_m, \qquad k_{i,m} = \rho^2 - \zeta +
        k_{p,m} .

    *Stability.* The bound :math:`M_m` is 1/2, 1/4, 1/8 or 1/16 of the range in which a
    constant gain leaves the loop stable, and at most `saturation`. It is the largest of
    these that meets the circle criterion, which certifies every sequence of gains.

    *Residual.* The sliding surface is the fault estimate. Its switching gain follows
    :math:`\ln K^+ = \ln K + s\,\mathrm{sgn}(|\hat\delta| - K)` and settles at the median
    of :math:`|\hat\delta|`, which the impacts of a fault hardly change, while they raise
    the power :math:`P = \ln\overline{\hat\delta^2}`. So P, :math:`2\ln K` and the
    steadiness :math:`2\ln K - P` over m describe a window. `SpectralDistance` compares
    them with those of each condition, and discounts what a change of speed does to
    them. The result is one residual for each condition.

    With ``n_observers=1`` there is one observer with the gains `kp` and `ki` for each
    model, and the residual is the level of its output error, see `evaluation`. At other
    speeds this reading is the weakest.

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`, any for which the observer is stable.
    ki : float, default=0.028
        Integral gain :math:`k_i`, at least 0. The larger it is, the faster the
        observers are, and the wider the band of each one in a bank.
    saturation : float, default=1.0
        Largest bound on :math:`|p|`, at least 0, in the unit of the innovations. At 0
        the observers are linear.
    n_observers : int, default=64
        Number M of observers, at least 1.
    adaptation_step : float, default=0.05
        Step s of the logarithm of the switching gain per sample, in (0, 1].
    evaluation : {"power", "switching_gain"}, default="switching_gain"
        Residual of a single observer, computed from its error e. "power": the root mean
        square of e. "switching_gain": the adapted gain of the sliding-mode residual,
        which settles at the median size of the surface.
    sliding_slope : float, default=10.0
        Slope :math:`\lambda` of the surface of a single observer, :math:`S = \lambda e
        + (e(k) - e(k-1))`, at least 0.
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0. It
        affects the residual that `observe` returns, and nothing else.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,) or (n_models,)
        Conditions, sorted, one for each residual. Of a single observer whose `fit` was
        not given one condition for each model, the numbers of the models.
    kp_, ki_ : ndarray of shape (n_observers,)
        Gains of each observer.
    bounds_ : ndarray of shape (n_observers,)
        The bounds :math:`M_m`.
    distance_ : SpectralDistance or None
        The fitted comparison of a bank. None for a single observer.
    n_models_ : int
        Number of models that the innovations are from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    PIObserver : The linear observer of the baseline.
    ThresholdLadder : Decides by the residuals.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.pipeline import Pipeline
    >>> from skarxlag import ARXLaguerre, ThresholdLadder
    >>> from skarxlag.datasets import simulate_rig
    >>> rig = simulate_rig(rpm=(300, 500), crack_mm=6, n_samples=24_000, random_state=0)
    >>> diagnoser = Pipeline([
    ...     ("identify", ARXLaguerre()),
    ...     ("observe", ExtendedStatePIObserver()),
    ...     ("decide", ThresholdLadder()),
    ... ])
    >>> at_500 = rig.rpm == 500
    >>> diagnoser = diagnoser.fit(rig.data[at_500], rig.target[at_500])
    >>> diagnoser.score(rig.data[~at_500], rig.target[~at_500]) > 0.8
    True

    Unstable gains are refused:

    >>> ExtendedStatePIObserver(ki=2.0).fit(rig.data[:, 0], rig.target)
    Traceback (most recent call last):
        ...
    ValueError: The observer is unstable: with pole=0.3, kp=0.1 and ki=2.0, its spectral ...
    """

    ki: float = 0.028
    saturation: float = 1.0
    n_observers: int = 64
    evaluation: str = "switching_gain"

    def _saturation(self):
        return self.saturation

    def _check_parameters(self):
        super()._check_parameters()
        check_real(self.saturation, "saturation", min_val=0)


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

    By default there is one observer for each model, as in the paper's baseline ALPIO.
    With several observers, it is `ExtendedStatePIObserver` without its nonlinearity.

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    kp : float, default=0.1
        Proportional gain :math:`k_p`, any for which the observer is stable.
    ki : float, default=0.05
        Integral gain :math:`k_i`, at least 0.
    n_observers : int, default=1
        Number of observers, at least 1.
    adaptation_step : float, default=0.05
        As in `ExtendedStatePIObserver`.
    evaluation : {"power", "switching_gain"}, default="power"
        As in `ExtendedStatePIObserver`.
    sliding_slope : float, default=10.0
        As in `ExtendedStatePIObserver`.
    boundary_layer : float, default=0.0
        As in `ExtendedStatePIObserver`.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,) or (n_models,)
        As in `ExtendedStatePIObserver`.
    kp_, ki_, bounds_ : ndarray of shape (n_observers,)
        Gains of each observer, and bounds of 0.
    distance_ : SpectralDistance or None
        As in `ExtendedStatePIObserver`.
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
