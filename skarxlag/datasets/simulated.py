"""The simulated rig: the acoustic emission of a faulty bearing, and the drive torque."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import Bunch, check_random_state, check_scalar

from ..core.state import expect
from ..core.validation import check_count
from .frames import in_form
from .rig import (
    DEFAULT_RIG,
    LOCATIONS,
    Rig,
    background,
    defect_emission,
)

# The conditions of the bearing, with the paper's names, and the locations of their
# defects.
CONDITIONS: dict[str, tuple[str, ...]] = {
    "Normal": (),
    "IR": ("inner",),
    "OR": ("outer",),
    "Ball": ("ball",),
    "IR-Ball": ("inner", "ball"),
    "OR-Ball": ("outer", "ball"),
    "IR-OR": ("inner", "outer"),
    "IR-OR-Ball": ("inner", "outer", "ball"),
}

# Each recording or defect has one independent stream of random numbers for each of
# these names.
STREAMS = ("torque", "noise", "friction", "strikes", "rubbing")


_DESCRIPTION = """Simulated rig, not a measurement.

Acoustic emission of a rolling-element bearing and the torque of its drive, simulated
from the physics that `simulate_rig` documents. Conditions, speeds, crack sizes and the
sampling follow Table 1 of F. Piltan, J.-M. Kim, "Nonlinear Extended-state ARX-Laguerre PI
Observer Fault Diagnosis of Bearings", Applied Sciences 9(5), 888, 2019.
Licence: BSD-3-Clause, as the code that generates it.
"""


def _positive_numbers(name, values):
    array = np.atleast_1d(pd.to_numeric(values, errors="coerce")).astype(float)
    fits = (array > 0) & (array < np.inf) & (array.size == len(set(array)) > 0)
    expect(fits.any() and fits, name, values, "different positive numbers")
    return array.tolist()


def _generator(entropy, key, stream):
    """Return the generator of one stream of one recording or defect, independent of all others."""
    words = np.array(key, dtype=np.float64).view(np.uint32).tolist()
    seed = np.random.SeedSequence(entropy, spawn_key=(*words, STREAMS.index(stream)))
    return np.random.default_rng(seed)


def simulate_rig(
    *,
    rpm: ArrayLike = (300, 400, 450, 500),
    crack_mm: ArrayLike = (3, 6),
    conditions: str | Sequence[str] | None = None,
    n_samples: int = 120_000,
    window_length: int = 1200,
    rig: Rig = DEFAULT_RIG,
    random_state: int | np.random.RandomState | None = 0,
    return_fault: bool = False,
    return_X_y: bool = False,
    as_frame: bool = False,
) -> Any:
    r"""Simulate the acoustic emission and the drive torque of a bearing rig.

    The output of a recording is

    .. math::

        y(k) = \sum_{d} \left[ h_d * s_d + c\,w_d\,v\;(g_d * \xi_d) \right](k)
        + \sum_{l} b\,v\;(g_l * \xi'_l)(k) + \sum_{i \ge 1} \beta_i\, u(k - i) + \sigma\,\eta(k)

    The first sum is over the defects d of the condition, the second over all locations l
    (outer ring, inner ring, ball). The terms are, in this order:

    - strikes :math:`s_d` at the defect frequency, filtered by the transmission path
      :math:`h_d` of the defect's location;
    - rubbing at a crack of width :math:`w_d`;
    - friction of the whole bearing;
    - the torque u, which leaks into the output;
    - sensor noise.

    :math:`\xi, \xi', \eta` are white noise, v is the speed of the rolling contact, and
    :math:`g` is the transmission path combined with the low-pass spectrum of friction.
    The factors c, b and :math:`\sigma` are `rubbing_level`, `friction_level` and
    `noise_level`, and :math:`\beta_i` is `torque_leak`.

    A compound fault is the superposition of its single faults. The emission of a defect
    depends only on its location, the speed and the crack, and its realisation is the same
    in the recordings of the single and of the compound fault. Torque, friction of the
    healthy bearing and noise are independent between recordings. A recording does not
    depend on which other recordings are generated.

    The defaults of the parameters and of the sampling rate are those of Table 1 of
    [1]_. The paper neither names its bearing nor publishes a signal, so the other
    physical parameters are set for physical plausibility, see
    :class:`skarxlag.datasets.rig.Rig`.

    A window of 1200 samples at 250 kHz lasts 4.8 ms. This is shorter than the interval
    between two strikes at every defect frequency and speed of the default rig (22 to 56
    ms). The entry into a crack and the impact at its end are 3 to 10 ms apart. Most
    windows of a faulty condition therefore contain no strike, and a diagnoser of single
    windows can only use the spectrum and the level of the continuous emission.

    Parameters
    ----------
    rpm : float or array-like of float, default=(300, 400, 450, 500)
        Shaft speeds in revolutions per minute. Source: [1]_, Table 1.
    crack_mm : float or array-like of float, default=(3, 6)
        Widths of the crack along the rolling direction, in mm. They must not exceed the
        diameter of an element. Source: [1]_, Table 1. The normal condition has no crack
        and has one recording for each speed.
    conditions : str or sequence of str, default=None
        Which of "Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR" and
        "IR-OR-Ball" to simulate. If None, all are simulated. Source: [1]_, Tables 1 and
        2.
    n_samples : int, default=120_000
        Number of samples of a recording, a multiple of `window_length`. Source: [1]_,
        section 5.
    window_length : int, default=1200
        Number of samples of a window. Source: [1]_, section 5.
    rig : Rig, optional
        The physical parameters: sampling rate, bearing, transmission paths, slip, and
        the levels of the sources. The default is ``Rig()``, see
        :class:`skarxlag.datasets.rig.Rig`.
    random_state : int, RandomState instance or None, default=0
        Seed or generator of the random numbers.
    return_fault : bool, default=False
        If True, also return the known fault signal, which takes half the memory of
        `data`. This does not change `data`.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    as_frame : bool, default=False
        If True, the Bunch has ``frame``, a table with ``rpm``, ``recording``,
        ``start``, ``specimen`` and ``load`` of each window. Splitters take its columns
        as `groups`.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings. Windows of one recording are consecutive and in
        time order. The attributes are

        - data : float64 ndarray of shape (n_windows, 2, window_length); channel 0 the
          acoustic emission in V (output), channel 1 the drive torque in N m (measured
          input)
        - target : str ndarray of shape (n_windows,), the condition
        - target_names : list of str, the conditions, the healthy one first
        - specimen : str ndarray of shape (n_windows,), the condition: nothing but the
          crack differs between the simulated bearings
        - load : float ndarray of shape (n_windows,), NaN: no load is simulated
        - rpm : float ndarray of shape (n_windows,)
        - crack_mm : float ndarray of shape (n_windows,), 0 for the normal condition
        - recording : str ndarray of shape (n_windows,)
        - start : int ndarray of shape (n_windows,), first sample in the recording
        - fault : float64 ndarray of shape (n_windows, window_length), only with
          ``return_fault=True``; the first sum of the equation, which is the
          contribution of the defects to channel 0 of `data`, in V; 0 for the normal
          condition
        - sampling_rate : float, in Hz
        - DESCR : str
    (data, target) : tuple of ndarray
        The windows and their conditions, if `return_X_y` is True.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range or of another type.

    References
    ----------
    .. [1] F. Piltan, J.-M. Kim, "Nonlinear Extended-state ARX-Laguerre PI Observer
           Fault Diagnosis of Bearings", Applied Sciences 9(5), 888, 2019.

    Examples
    --------
    >>> from .simulated import simulate_rig
    >>> rig = simulate_rig(rpm=500, crack_mm=3, conditions=["Normal", "IR"], n_samples=12_000)
    >>> rig.data.shape
    (20, 2, 1200)
    >>> rig.target[[0, 10]].tolist(), str(rig.recording[10])
    (['Normal', 'IR'], 'IR_500rpm_3mm')

    The contribution of the crack alone:

    >>> rig = simulate_rig(rpm=500, crack_mm=3, conditions=["Normal", "IR"], n_samples=12_000,
    ...                    return_fault=True)
    >>> rig.fault.shape, float(abs(rig.fault[rig.target == "Normal"]).max())
    ((20, 1200), 0.0)
    """
    speeds = _positive_numbers("rpm", rpm)
    cracks = _positive_numbers("crack_mm", crack_mm)
    requested = list(CONDITIONS)
    if conditions is not None:
        requested = np.atleast_1d(conditions).tolist()
    fits = 0 < len(requested) == len({*requested} & {*CONDITIONS})
    expect(fits, "conditions", conditions, f"different names out of {list(CONDITIONS)}")
    names = [name for name in CONDITIONS if name in requested]
    check_count(window_length, "window_length")
    check_count(n_samples, "n_samples")
    is_whole = n_samples % window_length == 0
    expected = f"a multiple of window_length={window_length}"
    expect(is_whole, "n_samples", n_samples, expected)
    check_scalar(rig, "rig", Rig)
    diameter = rig.bearing.element_diameter
    expected = f"at most an element, {diameter} mm"
    expect(max(cracks) <= diameter, "crack_mm", crack_mm, expected)
    random = check_random_state(random_state)
    entropy = random.randint(2**32, size=4, dtype=np.uint32).tolist()
    recordings = [
        (speed, name, crack)
        for speed, name in product(speeds, names)
        for crack in (cracks if CONDITIONS[name] else [0.0])
    ]
    n_windows = n_samples // window_length
    data = np.empty((len(recordings), n_windows, 2, window_length))
    fault = np.zeros((len(recordings), n_samples)) if return_fault else None
    defects = {}
    for row, (speed, name, crack) in enumerate(recordings):
        key = (list(CONDITIONS).index(name), speed, crack)
        emission, torque = background(
            rig, speed, n_samples, partial(_generator, entropy, key)
        )
        for location in CONDITIONS[name]:
            defect = (LOCATIONS.index(location), speed, crack)
            if defect not in defects:
                generator = partial(_generator, entropy, defect)
                emitted = defect_emission(
                    rig, speed, location, crack, n_samples, generator
                )
                defects[defect] = emitted
            emission += defects[defect]
            if return_fault:
                fault[row] += defects[defect]
        channels = np.stack([emission, torque]).reshape(2, n_windows, -1)
        data[row] = channels.swapaxes(0, 1)

    names_of_recordings = [
        f"{name}_{speed:.12g}rpm" + (f"_{crack:.12g}mm" if crack else "")
        for speed, name, crack in recordings
    ]
    source = np.repeat(np.arange(len(recordings)), n_windows)
    rpm_of, condition_of, crack_of = (
        np.array(column) for column in zip(*recordings, strict=True)
    )
    simulated = Bunch(
        data=data.reshape(-1, 2, window_length),
        target=condition_of[source],
        target_names=names,
        specimen=condition_of[source],
        load=np.full(len(source), np.nan),
        rpm=rpm_of[source],
        crack_mm=crack_of[source],
        recording=np.array(names_of_recordings)[source],
        start=np.tile(np.arange(n_windows) * window_length, len(recordings)),
        sampling_rate=float(rig.sampling_rate),
        DESCR=_DESCRIPTION,
    )
    if return_fault:
        simulated.fault = fault.reshape(-1, window_length)
    return in_form(simulated, return_X_y=return_X_y, as_frame=as_frame)
