r"""Known faults, in the units in which an observer estimates them.

An observer estimates the scalar d of :math:`\varepsilon_f(k+1) =
\zeta\,\varepsilon_f(k) + d(k)`, where :math:`\varepsilon_f` is what a fault adds to the
innovations of the healthy model. The model is linear, so for a fault f that adds to the
output it is the innovations with f less those without.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from sklearn.utils import Bunch

from skarxlag import ARXLaguerre
from skarxlag.datasets import simulate_rig
from skarxlag.datasets.transmission import TransmissionPaths, impulse_response

POLE = 0.3
RPM = 500
#: 48 ms, more than the interval between two impacts of every defect at 500 rpm.
WINDOW_LENGTH = 12_000
CONDITIONS = ("IR", "OR", "Ball")
SHAPES = ("constant", "step", "ramp", "impact")
#: Peak of the impact at the output in units of the healthy output's root-mean-square.
IMPACT_PEAK = 10.0


@dataclass(frozen=True)
class Healthy:
    """The healthy model, and the one number that its innovations are divided by.

    Parameters
    ----------
    model : ARXLaguerre
        Identified on normal windows, in the sensor's unit.
    rms : float
        Root-mean-square of the healthy output. Unlike the usual scaling of each window
        it does not depend on the fault.
    """

    model: ARXLaguerre
    rms: float

    def innovations(self, windows):
        """Innovations in units of the healthy output, of shape (n_windows, n_samples')."""
        return self.model.transform(windows)[:, 0] / self.rms

    def output_response(self, n_samples):
        """Response of the innovations to an impulse that is added to the output."""
        space = self.model.state_space()
        order = self.model.orders_[0]
        A = space.A[:order, :order]
        b = space.b_y[:order]
        coef = space.coef[0, :order]
        response = np.zeros(n_samples)
        response[0] = 1.0
        for k in range(1, n_samples):
            response[k] = -coef @ b
            b = A @ b
        return response


def identified(seed, n_samples):
    """Fit the healthy model on a separate recording."""
    rig = simulate_rig(
        rpm=RPM,
        conditions="Normal",
        n_samples=n_samples,
        window_length=WINDOW_LENGTH,
        random_state=seed,
    )
    model = ARXLaguerre(pole=POLE, unit_rms=False).fit(rig.data)
    return Healthy(model, float(rig.data[:, 0].std()))


def recordings(seed, n_samples):
    """Windows of the normal condition and of single faults, with the known fault signal."""
    return simulate_rig(
        rpm=RPM,
        conditions=("Normal", *CONDITIONS),
        n_samples=n_samples,
        window_length=WINDOW_LENGTH,
        random_state=seed,
        return_fault=True,
    )


def disturbance(innovations, pole=POLE):
    r"""The d of :math:`\varepsilon_f(k+1) = \zeta\,\varepsilon_f(k) + d(k)`.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_samples)
        What the fault adds to the innovations.

    Returns
    -------
    ndarray of shape (n_windows, n_samples - 1)
        The signal that an observer estimates.

    Examples
    --------
    >>> disturbance(np.array([[0.0, 1.0, 2.0]]), pole=0.5)
    array([[1. , 1.5]])
    """
    return innovations[:, 1:] - pole * innovations[:, :-1]


def seen_through(innovations_pole, d):
    """Return the contribution of a disturbance to the innovations, of the shape of `d`."""
    return lfilter([0.0, 1.0], [1.0, -innovations_pole], d)


def bearing_fault(healthy, rig, condition, crack_mm):
    """Innovations of a faulty bearing, and its known disturbance.

    Returns
    -------
    Bunch
        ``innovations`` of shape (n_windows, n_samples), ``true`` of (n_windows,
        n_samples - 1).
    """
    rows = (rig.target == condition) & (rig.crack_mm == crack_mm)
    without = rig.data[rows].copy()
    without[:, 0] -= rig.fault[rows]
    innovations = healthy.innovations(rig.data[rows])
    return Bunch(
        innovations=innovations,
        true=disturbance(innovations - healthy.innovations(without)),
    )


def synthetic_fault(healthy, rig, shape):
    """A fault of known shape, added to the output of a healthy bearing.

    The disturbance of "constant", "step" and "ramp" has the size 1, in units of the
    healthy output; the last two start in the middle of a window. "impact" is one impact
    on the outer ring in the middle, of `IMPACT_PEAK` at the output.

    Returns
    -------
    Bunch
        ``true``, the disturbance of shape (n_windows, n_samples - 1); ``innovations``
        with the fault added to the innovations; ``through_windows``, the innovations
        with the fault added to the output before windows are centred, both (n_windows,
        n_samples).
    """
    windows = rig.data[rig.target == "Normal"]
    quiet = healthy.innovations(windows)
    n_windows, n_samples = quiet.shape
    n_transient = windows.shape[-1] - n_samples
    response = healthy.output_response(windows.shape[-1])
    time = np.arange(windows.shape[-1])
    onset = windows.shape[-1] // 2
    if shape == "impact":
        burst = impulse_response(TransmissionPaths().outer, rig.sampling_rate)
        output = np.zeros(windows.shape[-1])
        n_kept = min(len(burst), len(output) - onset)
        output[onset : onset + n_kept] = IMPACT_PEAK * burst[:n_kept]
        added = lfilter(response, 1.0, output)
    else:
        d = {
            "constant": np.ones(len(time)),
            "step": np.where(time >= onset, 1.0, 0.0),
            "ramp": np.clip((time - onset) / (len(time) - onset), 0.0, None),
        }[shape]
        added = seen_through(POLE, d)
        output = lfilter([1.0], response, added)
    faulty = windows.copy()
    faulty[:, 0] += healthy.rms * output
    seen = added[n_transient:]
    return Bunch(
        innovations=quiet + seen,
        through_windows=healthy.innovations(faulty),
        true=np.tile(disturbance(seen[np.newaxis]), (n_windows, 1)),
    )
