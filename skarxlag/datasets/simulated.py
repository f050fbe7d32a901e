"""The simulated rig: the acoustic emission of a faulty bearing, and the drive torque."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils import Bunch, check_random_state, check_scalar

from skarxlag.bearings import SKF_6205, BearingGeometry
from skarxlag.datasets.rig import LOCATIONS, Rig, background, defect_emission
from skarxlag.datasets.torque import DriveTorque
from skarxlag.datasets.transmission import TransmissionPaths

__all__ = ["CONDITIONS", "simulate_rig"]

# The conditions of the bearing, with the paper's names, and the locations of their defects.
CONDITIONS: dict[str, Any] = {
    "Normal": (),
    "IR": ("inner",),
    "OR": ("outer",),
    "Ball": ("ball",),
    "IR-Ball": ("inner", "ball"),
    "OR-Ball": ("outer", "ball"),
    "IR-OR": ("inner", "outer"),
    "IR-OR-Ball": ("inner", "outer", "ball"),
}

# Each recording or defect has one independent stream of random numbers for each of these names.
STREAMS = ("torque", "noise", "friction", "strikes", "rubbing")

DESCR = """\
Simulated rig
-------------

Acoustic emission of a rolling-element bearing and the torque of its drive, simulated from the
physics that `simulate_rig` documents. Not a measurement.

:Conditions: {conditions}
:Shaft speeds: {rpm} rpm
:Crack widths: {crack_mm} mm (0 stands for the normal condition)
:Sampling rate: {sampling_rate:g} Hz
:Recordings: {n_recordings} of {n_samples} samples, cut into windows of {window_length}
:data: (n_windows, 2, window_length); channel 0 is the acoustic emission in V (the output),
    channel 1 the drive torque in N m (the measured input)
:Licence: BSD-3-Clause, as the code that generates it

The design (conditions, speeds, crack sizes, sampling) follows Table 1 of F. Piltan, J.-M. Kim,
"Nonlinear Extended-state ARX-Laguerre PI Observer Fault Diagnosis of Bearings", Applied Sciences
9(5), 888, 2019, doi:10.3390/app9050888.
"""


def _check_positive_values(name, values):
    try:
        array = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must hold positive numbers, got {values!r}.") from error
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)) or array.min() <= 0:
        raise ValueError(f"{name} must hold positive numbers, got {values!r}.")
    if len(np.unique(array)) != array.size:
        raise ValueError(f"{name} must not repeat a value, got {values!r}.")
    return array.tolist()


def _check_conditions(conditions):
    if conditions is None:
        return list(CONDITIONS)
    chosen = [conditions] if isinstance(conditions, str) else list(conditions)
    if not chosen or len(set(chosen)) != len(chosen) or not set(chosen) <= set(CONDITIONS):
        raise ValueError(
            f"conditions must be distinct names out of {list(CONDITIONS)}, got {conditions!r}."
        )
    return [name for name in CONDITIONS if name in chosen]


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
    sampling_rate: float = 250_000.0,
    bearing: BearingGeometry = SKF_6205,
    paths: TransmissionPaths | None = None,
    torque: DriveTorque | None = None,
    torque_leak: ArrayLike = (0.10, 0.05, -0.05, -0.10),
    slip: float = 0.01,
    load_distribution: float = 0.5,
    impact_level: float = 0.5,
    entry_ratio: float = 0.3,
    friction_level: float = 0.02,
    rubbing_level: float = 0.01,
    asperity_um: float = 5.0,
    noise_level: float = 5e-4,
    random_state: int | np.random.RandomState | None = 0,
    return_fault: bool = False,
    return_X_y: bool = False,
) -> Any:
    r"""Simulate the acoustic emission and the drive torque of a bearing rig.

    The output of a recording is

    .. math::

        y(k) = \sum_{d} \left[ h_d * s_d + c\,w_d\,v\;(g_d * \xi_d) \right](k)
        + \sum_{l} b\,v\;(g_l * \xi'_l)(k) + \sum_{i \ge 1} \beta_i\, u(k - i) + \sigma\,\eta(k)

    The first sum is over the defects d of the condition, the second over all places l (outer ring,
    inner ring, ball). The terms are, in this order:

    - strikes :math:`s_d` at the defect frequency, filtered by the transmission path :math:`h_d` of
      the defect's place;
    - rubbing at a crack of width :math:`w_d`;
    - friction of the whole bearing;
    - the torque u, which leaks into the output;
    - sensor noise.

    :math:`\xi, \xi', \eta` are white noise, v is the speed of the rolling contact, and :math:`g` is
    the transmission path combined with the low-pass spectrum of friction. The factors c, b and
    :math:`\sigma` are `rubbing_level`, `friction_level` and `noise_level`, and :math:`\beta_i` is
    `torque_leak`.

    A compound fault is the superposition of its single faults. The emission of a defect depends
    only on its place, the speed and the crack, and its realisation is the same in the recordings
    of the single and of the compound fault. Torque, friction of the healthy bearing and noise are
    independent between recordings. A recording does not depend on which other recordings are
    generated.

    The defaults of the parameters up to `sampling_rate` are those of Table 1 of [1]_. The paper
    neither names its bearing nor publishes a signal, so the defaults of all later parameters are
    chosen for physical plausibility. The word "chosen" below marks a value without a source.

    A window of 1200 samples at 250 kHz lasts 4.8 ms. This is shorter than the interval between two
    strikes at every defect frequency and speed of the default rig (22 to 56 ms). The entry into a
    crack and the impact at its end are 3 to 10 ms apart. Most windows of a faulty condition
    therefore contain no strike, and a diagnoser of single windows can only use the spectrum and
    the level of the continuous emission.

    Parameters
    ----------
    rpm : float or array-like of float, default=(300, 400, 450, 500)
        Shaft speeds in revolutions per minute. Source: [1]_, Table 1.
    crack_mm : float or array-like of float, default=(3, 6)
        Widths of the crack along the rolling direction, in mm. They must not exceed the diameter of
        an element. Source: [1]_, Table 1. The normal condition has no crack and has one recording
        for each speed.
    conditions : str or sequence of str, default=None
        Which of "Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR" and "IR-OR-Ball" to
        simulate. If None, all are simulated. Source: [1]_, Tables 1 and 2.
    n_samples : int, default=120_000
        Number of samples of a recording, a multiple of `window_length`. Source: [1]_, section 5.
    window_length : int, default=1200
        Number of samples of a window. Source: [1]_, section 5.
    sampling_rate : float, default=250_000.0
        Sampling rate in Hz. Source: [1]_, section 2.
    bearing : BearingGeometry, default=SKF_6205
        The bearing. The default is the SKF 6205-2RS JEM, the drive-end bearing of the Case Western
        Reserve University data, with the dimensions published there.
    paths : TransmissionPaths, default=None
        Resonances, gain and delay between each place and the sensor. If None, the paths are
        ``TransmissionPaths()``, whose docstring states the sources.
    torque : DriveTorque, default=None
        Components of the drive torque. If None, they are ``DriveTorque()``, whose docstring states
        the sources.
    torque_leak : sequence of float, default=(0.10, 0.05, -0.05, -0.10)
        Response of the output to the torque 1, 2, ... samples earlier, in V/(N m). An empty
        sequence means no leak. Chosen: the values sum to zero, because amplifiers of acoustic
        emission block the mean.
    slip : float, default=0.01
        Standard deviation of the interval between two strikes relative to its mean, in [0, 0.1].
        Source: 1 to 2 % is usual [2]_.
    load_distribution : float, default=0.5
        Load distribution factor, > 0. Source: 0.5 for a bearing without clearance [3]_.
    impact_level : float, default=0.5
        Peak output for a unit velocity of impact through a path of unit gain, in V/(m/s).
        Chosen: the bursts of a crack of 3 mm in the outer ring at 500 rpm are about 14 dB above
        the continuous emission.
    entry_ratio : float, default=0.3
        Strength of the strike at the entry into a crack, relative to the impact at its end. Chosen;
        the entry is weaker than the impact [4]_.
    friction_level : float, default=0.02
        RMS output from friction at one place for a unit contact speed through a path of unit gain,
        in V/(m/s). Chosen: about 10 mV at 500 rpm behind a preamplifier of 40 dB. The RMS
        of acoustic emission grows with the speed [5]_.
    rubbing_level : float, default=0.01
        RMS output from rubbing at a defect for each millimetre of its crack, for a unit contact
        speed through a path of unit gain, in V/(m/s)/mm. Chosen; the RMS grows with the defect
        [5]_.
    asperity_um : float, default=5.0
        Length of an asperity contact in micrometres, > 0. Together with the contact speed it
        determines the corner frequency of the friction spectrum (see
        `skarxlag.datasets.transmission.friction_response`). Chosen: a ground raceway.
    noise_level : float, default=5e-4
        RMS of the sensor noise in V. Chosen: 5 uV at the input of a preamplifier of 40 dB.
    random_state : int, RandomState instance or None, default=0
        Seed or generator of the random numbers.
    return_fault : bool, default=False
        If True, also return the known fault signal, which takes half the memory of `data`. This
        does not change `data`, and requires ``return_X_y=False``.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings. Windows of one recording are consecutive and in time order.
        The attributes are

        - data : float64 ndarray of shape (n_windows, 2, window_length); channel 0 the acoustic
          emission in V (output), channel 1 the drive torque in N m (measured input)
        - target : str ndarray of shape (n_windows,), the condition
        - target_names : list of str, the conditions, the healthy one first
        - rpm : float ndarray of shape (n_windows,)
        - crack_mm : float ndarray of shape (n_windows,), 0 for the normal condition
        - recording : str ndarray of shape (n_windows,)
        - start : int ndarray of shape (n_windows,), first sample in the recording
        - fault : float64 ndarray of shape (n_windows, window_length), only with
          ``return_fault=True``; the first sum of the equation, which is the contribution of the
          defects to channel 0 of `data`, in V; 0 for the normal condition
        - sampling_rate : float, in Hz
        - DESCR : str

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range or of another type, or if both `return_fault` and
        `return_X_y` are True.

    References
    ----------
    .. [1] F. Piltan, J.-M. Kim, "Nonlinear Extended-state ARX-Laguerre PI Observer Fault
       Diagnosis of Bearings", Applied Sciences 9(5), 888, 2019.
    .. [2] R. B. Randall, J. Antoni, "Rolling element bearing diagnostics - a tutorial",
       Mechanical Systems and Signal Processing 25, 2011.
    .. [3] T.A. Harris, M.N. Kotzalas, "Rolling Bearing Analysis", 5th ed., 2006.
    .. [4] N. Sawalhi, R. B. Randall, "Vibration response of spalled rolling element bearings:
       observations, simulations and signal processing techniques to track the spall size",
       Mechanical Systems and Signal Processing 25, 2011.
    .. [5] A. M. Al-Ghamd, D. Mba, "A comparative experimental study on the use of acoustic
       emission and vibration analysis for bearing defect identification and estimation of
       defect size", Mechanical Systems and Signal Processing 20, 2006.

    Examples
    --------
    >>> from skarxlag.datasets.simulated import simulate_rig
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
    if return_fault and return_X_y:
        raise ValueError(
            "return_fault=True puts the fault signal into the Bunch, which return_X_y=True does "
            "not return: expected one of them at most."
        )
    speeds = _check_positive_values("rpm", rpm)
    cracks = _check_positive_values("crack_mm", crack_mm)
    names = _check_conditions(conditions)
    check_scalar(window_length, "window_length", (int, np.integer), min_val=1)
    check_scalar(n_samples, "n_samples", (int, np.integer), min_val=1)
    if n_samples % window_length:
        raise ValueError(
            f"n_samples must be a multiple of window_length={window_length}, got {n_samples}."
        )
    rig = Rig(
        sampling_rate=sampling_rate,
        bearing=bearing,
        paths=TransmissionPaths() if paths is None else paths,
        torque=DriveTorque() if torque is None else torque,
        torque_leak=torque_leak,
        slip=slip,
        load_distribution=load_distribution,
        impact_level=impact_level,
        entry_ratio=entry_ratio,
        friction_level=friction_level,
        rubbing_level=rubbing_level,
        asperity_um=asperity_um,
        noise_level=noise_level,
    )
    if max(cracks) > bearing.element_diameter:
        raise ValueError(
            "crack_mm must not exceed the diameter of an element, "
            f"{bearing.element_diameter} mm, got {crack_mm!r}."
        )
    entropy = check_random_state(random_state).randint(2**32, size=4, dtype=np.uint32).tolist()

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
        emission, drive = background(rig, speed, n_samples, partial(_generator, entropy, key))
        for location in CONDITIONS[name]:
            defect = (LOCATIONS.index(location), speed, crack)
            if defect not in defects:
                defects[defect] = defect_emission(
                    rig, speed, location, crack, n_samples, partial(_generator, entropy, defect)
                )
            emission += defects[defect]
            if return_fault:
                fault[row] += defects[defect]
        data[row, :, 0] = emission.reshape(n_windows, window_length)
        data[row, :, 1] = drive.reshape(n_windows, window_length)

    data = data.reshape(-1, 2, window_length)
    speed_column, name_column, crack_column = zip(*recordings, strict=True)
    target = np.repeat(name_column, n_windows)
    if return_X_y:
        return data, target
    identifiers = [
        f"{name}_{speed:.12g}rpm" + (f"_{crack:.12g}mm" if crack else "")
        for speed, name, crack in recordings
    ]
    on_request = {"fault": fault.reshape(-1, window_length)} if return_fault else {}
    return Bunch(
        data=data,
        target=target,
        target_names=names,
        rpm=np.repeat(speed_column, n_windows),
        crack_mm=np.repeat(crack_column, n_windows),
        recording=np.repeat(identifiers, n_windows),
        start=np.tile(np.arange(n_windows) * window_length, len(recordings)),
        sampling_rate=float(sampling_rate),
        DESCR=DESCR.format(
            conditions=", ".join(names),
            rpm=", ".join(f"{speed:g}" for speed in speeds),
            crack_mm=", ".join(f"{crack:g}" for crack in sorted(set(crack_column))),
            sampling_rate=sampling_rate,
            n_recordings=len(recordings),
            n_samples=n_samples,
            window_length=window_length,
        ),
        **on_request,
    )
