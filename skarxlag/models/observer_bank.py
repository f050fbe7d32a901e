"""Bank of extended-state observers over frequency: from innovations to log spectra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.base import GroupTransformer
from ..core.state import expect
from ..core.validation import ABOVE_0, WITHIN_1, check_count, check_real
from ..kernels import observer, spectra
from ..kernels.observer_bank import bank_levels, member_gains

#: Step of the logarithm of K per sample: K crosses a decade in 46 samples, and so
#: settles in short windows.
_ADAPTATION_STEP = 0.05


# A search over other parameters fits the same bank many times.
@lru_cache(maxsize=4096)
def _certificate(pole, kp, ki, bound):
    slow, fast = (
        observer.loop_matrix(pole, kp, ki, gain) for gain in (1.0, 1.0 + bound)
    )
    return observer.common_lyapunov(slow, fast)


@dataclass(kw_only=True, eq=False, repr=False)
class ExtendedStatePIObserverBank(GroupTransformer, auto_wrap_output_keys=None):
    r"""Bank of extended-state observers, each tuned to one frequency.

    The paper's fault is a vector. One observer of one output can estimate one component
    of it, so a vector takes one observer for each component. Member m of M observes the
    component at the frequency :math:`\omega_m = \pi (m + 1/2) / M`. It has the
    nonlinearity of `ExtendedStatePIObserver`: the gain from the integral p to the fault
    estimate d grows with the fault,

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + d, \qquad p^+ = p + k_i e, \qquad
        d^+ = (1 + \min(|p^+|, M_m))\,p^+ .

    The gains place the closed-loop poles for small faults at :math:`\rho\,e^{\pm
    j\omega_m}`:

    .. math::

        k_p = 1 + \zeta - 2\rho\cos\omega_m, \qquad k_i = \rho^2 - \zeta + k_p, \qquad
        \rho = e^{-b\pi/2M} .

    The bound :math:`M_m` of a member is 1/2, 1/4, 1/8 or 1/16 of the range in which a
    constant gain leaves its loop stable, and at most `saturation`. It is the largest of
    these for which one quadratic Lyapunov function exists for the loops with the
    smallest and with the largest gain. That certifies every sequence of gains between
    them. With ``saturation=0`` the members are linear, and ``bandwidth=1`` suits them
    better.

    Three levels describe the fault estimates d of a window: the power :math:`P =
    \ln\overline{d^2}`; :math:`2\ln K` with the gain K of a sliding-mode residual whose
    surface is d, :math:`\ln K^+ = \ln K + 0.05\,\mathrm{sgn}(|d| - K)`; and the
    steadiness :math:`2\ln K - P`. K settles at the median of :math:`|d|`, which the
    impacts of a fault hardly change, while they raise P. K runs over the first 256
    samples to settle, and then over the whole window, where it is averaged.

    Innovations have to be in units of their root mean square, as `ARXLaguerre` returns
    them, because the bound is in their unit.

    Parameters
    ----------
    pole : float, default=0.3
        Pole :math:`\zeta` of the output's Laguerre network, in (-1, 1).
    n_members : int, default=64
        Number M of observers, at least 2.
    bandwidth : float, default=1.5
        Bandwidth b of a member, above 0, in units of the distance between two
        neighbours. A narrow loop has a small stable range.
    saturation : float, default=1.0
        Largest bound that a member may have, at least 0.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    kp_, ki_ : ndarray of shape (n_members,)
        Gains of each member.
    bounds_ : ndarray of shape (n_members,)
        The bounds :math:`M_m`.
    lyapunov_ : ndarray of shape (n_members, 2, 2)
        Certificates P: A'PA - P is negative definite for both loops A of a member.
    frequencies_ : ndarray of shape (n_members,)
        Frequency that each member is tuned to, in radians per sample.
    n_models_ : int
        Number of models that the innovations are from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    ExtendedStatePIObserver : One observer, with one level for each model.
    SpectralDistance : Compares the groups with those of each condition.

    Examples
    --------
    A tone is strongest in the member that is tuned to it:

    >>> import numpy as np
    >>> tone = np.sin(1.0 * np.arange(1200))[np.newaxis]
    >>> bank = ExtendedStatePIObserverBank(saturation=0.0, bandwidth=1.0).fit(tone)
    >>> loudest = bank.transform(tone)[0, 0].argmax()
    >>> float(bank.frequencies_[loudest].round(2))
    1.01
    >>> bool((ExtendedStatePIObserverBank().fit(tone).bounds_ > 0).all())
    True
    """

    pole: float = 0.3
    n_members: int = 64
    bandwidth: float = 1.5
    saturation: float = 1.0
    n_jobs: int | None = None

    def _groups(self, signals):
        # Another order in memory or another type would have the loop compiled once
        # more.
        signals = np.ascontiguousarray(signals, dtype=np.float64)
        gains = float(self.pole), self.kp_, self.ki_, self.bounds_, _ADAPTATION_STEP
        power, gain = bank_levels(signals, *gains)
        return np.stack([power, gain, gain - power], axis=1)

    @property
    def frequencies_(self) -> NDArray[Any]:
        """Frequency that each member is tuned to, in radians per sample."""
        return spectra.frequency_grid(len(self.kp_))

    def _group_names(self):
        return ["power", "switching_gain", "steadiness"]

    def _check_parameters(self):
        check_real(self.pole, "pole", **WITHIN_1)
        check_count(self.n_members, "n_members", 2)
        check_real(self.bandwidth, "bandwidth", **ABOVE_0)
        check_real(self.saturation, "saturation", min_val=0)

    def _certify(self):
        kp, ki = member_gains(self.pole, self.n_members, self.bandwidth)
        self.kp_: NDArray[Any] = kp
        self.ki_: NDArray[Any] = ki
        self.bounds_: NDArray[Any] = np.zeros(self.n_members)
        self.lyapunov_: NDArray[Any] = np.empty((self.n_members, 2, 2))
        # Jury's first condition, a + k < 1, is the one that a larger gain breaks first.
        # A member's bound is a share of the stable range, tried in turn.
        for m, stable in enumerate((1 - (self.pole - kp)) / ki - 1):
            for bound in np.minimum(self.saturation, stable * 0.5 ** np.arange(1, 5)):
                certificate = _certificate(self.pole, kp[m], ki[m], bound)
                if certificate is not None:
                    break
            else:
                raise ValueError(
                    f"No common quadratic Lyapunov function certifies member {m} of the bank with "
                    f"pole={self.pole}, n_members={self.n_members} and bandwidth={self.bandwidth} "
                    f"up to the gain {1 + bound:.6g}; a larger bandwidth has more room."
                )
            self.bounds_[m] = bound
            self.lyapunov_[m] = certificate

    def _check_fitted(self):
        super()._check_fitted()
        self._check_array("kp_", (self.n_members,))
        self._check_array("ki_", (self.n_members,))
        self._check_array("bounds_", (self.n_members,), "at least 0")
        self._check_array("lyapunov_", (self.n_members, 2, 2))

    def _check_relations(self):
        gains = [self.kp_, self.ki_]
        given = member_gains(self.pole, self.n_members, self.bandwidth)
        are_given = np.allclose(gains, given, rtol=1e-6)
        expected = "the gains that pole and bandwidth give"
        expect(are_given, "kp_ and ki_", gains, expected)
