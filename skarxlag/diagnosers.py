"""The diagnosers, from windows to conditions, and what detects windows unlike known ones."""

from collections.abc import Mapping, Sequence
from typing import Any

from .bearings import BearingLike
from .core.pipelines import DiagnosisPipeline
from .decisions.condition_classifier import ConditionClassifier
from .decisions.fault_detector import FaultDetector
from .decisions.fault_orders import FaultOrderClassifier
from .decisions.known_conditions import KnownConditions
from .decisions.ladder import ThresholdLadder
from .distances.orders import OrderResidual
from .distances.stretches import StretchResidual, window_comparison
from .models.identification import ARXLaguerre
from .models.observers import ExtendedStatePIObserver, PIObserver

#: Order of the model of the recommended diagnoser, for the output and for measured
#: inputs. On the six rigs of docs/cross_speed.md together, order 1 of the output is as
#: good as order 4. Only the simulated rig has measured inputs, so their order is chosen
#: there.
MODEL_ORDER = (1, 32)
#: Order of the model before what compares rows with healthy ones.
_DETECTOR_ORDER = 8


def make_alpio(
    *, healthy: Any = None, n_jobs: int | None = None, **pipeline: Any
) -> DiagnosisPipeline:
    """The paper's baseline: ARX-Laguerre bank, linear observer, power of the error.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    n_jobs : int or None, default=None
        Threads that work on windows.
    **pipeline
        Other parameters of `DiagnosisPipeline`: `memory` and `verbose`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "observe" and "decide".

    Examples
    --------
    >>> [name for name, _ in make_alpio().steps]
    ['identify', 'observe', 'decide']
    """
    steps = [
        ("identify", ARXLaguerre(n_jobs=n_jobs)),
        ("observe", PIObserver(n_jobs=n_jobs)),
        ("decide", ThresholdLadder(healthy=healthy)),
    ]
    return DiagnosisPipeline(steps, n_jobs=n_jobs, **pipeline)


def make_extended_state_pio(
    *, healthy: Any = None, n_jobs: int | None = None, **pipeline: Any
) -> DiagnosisPipeline:
    """The paper's proposal, repaired: a bank of extended-state observers over frequency.

    These are the three steps of the package with their defaults. `ARXLaguerre` models
    each condition. Each of the 64 observers estimates the component of the fault at one
    frequency, with an adapted sliding-mode gain, and together they return one residual
    for each condition. `ThresholdLadder` decides.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    n_jobs : int or None, default=None
        Threads that work on windows.
    **pipeline
        Other parameters of `DiagnosisPipeline`: `memory` and `verbose`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "observe" and "decide".

    Examples
    --------
    >>> make_extended_state_pio()["observe"].n_observers
    64
    """
    steps = [
        ("identify", ARXLaguerre(n_jobs=n_jobs)),
        ("observe", ExtendedStatePIObserver(n_jobs=n_jobs)),
        ("decide", ThresholdLadder(healthy=healthy)),
    ]
    return DiagnosisPipeline(steps, n_jobs=n_jobs, **pipeline)


def make_diagnoser(
    *,
    sampling_rate: float | None = None,
    bearing: BearingLike | Sequence[BearingLike] | None = None,
    locations: Mapping[Any, str | None] | None = None,
    healthy: Any = None,
    n_jobs: int | None = None,
    **pipeline: Any,
) -> DiagnosisPipeline:
    """The recommended diagnoser, for windows and for stretches of a second.

    One model of all conditions takes out what they share, and what measured inputs
    explain. `LogSpectra` measures the innovations by their spectral shape and their
    steadiness. `SpectralDistance` compares both, as one vector, with those of each
    condition, and discounts what a change of speed does to them.

    With a sampling rate, a row may be longer than a window of 4800 samples: its windows
    are compared one by one. Rows of three revolutions of the shaft and more are compared by
    `OrderResidual`, too, that is by the orders of the shaft at which impacts come.

    Speeds are optional metadata: ``fit(X, y, rpm=rpm)`` and ``predict(X, rpm=rpm)``,
    one number of revolutions per minute for each row, or one for each of its samples.
    They may be wrong by 5 to 10 %. Without `rpm` in `predict` the speed is searched;
    without `rpm` in `fit`, all training rows count alike.

    With a bearing, the combs of its faults decide together with the spectra: see
    `FaultOrderClassifier`. After another load or mounting, spectra resemble no
    condition, and the combs still show the location of the fault. `fit` then needs `rpm`;
    in `predict` without `rpm`, spectra decide alone. If all training rows are healthy,
    the classes are their label and the locations "ball", "inner" and "outer": combs decide
    alone, with limits from these rows. Rows of another machine get its bearing with
    them: ``predict(X, rpm=900, bearing="6203")``.

    Use `make_detector` instead to find out whether a machine is healthy: the detection
    threshold of this diagnoser holds at the training speed only.

    Parameters
    ----------
    sampling_rate : float or None, default=None
        In Hz. None: rows are compared as one window each, and orders are not compared.
    bearing : BearingLike or sequence of BearingLike or None, default=None
        The bearing, as in `FaultOrderClassifier`. It requires a sampling rate.
    locations : mapping of label to str or None, default=None
        Place of each condition, if its name does not say it: "healthy", "inner",
        "outer" or "ball"; None for a location of its own, without a warning.
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    n_jobs : int or None, default=None
        Threads that work on rows.
    **pipeline
        Other parameters of `DiagnosisPipeline`: `memory` and `verbose`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "measure", "compare" and "decide"; with a sampling rate
        "identify", "compare" and "decide"; with a bearing "identify" and "decide".

    Raises
    ------
    ValueError
        If `bearing` is given without `sampling_rate`.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(40, 1200))
    >>> X = np.concatenate(
    ...     [lfilter([1], [1, -0.9], noise[:20]), lfilter([1], [1, 0.9], noise[20:])]
    ... )
    >>> y = np.repeat(["healthy", "worn"], 20)
    >>> make_diagnoser().fit(X, y).predict(1e6 * X[[0, 39]])
    array(['healthy', 'worn'], dtype='<U7')

    Stretches of two seconds, with impacts at order 3.6 of the shaft:

    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(12, 20_000))
    >>> X[6:, ::278] += 20                           # order 3.6 of 600 rpm
    >>> y = np.repeat(["healthy", "worn"], 6)
    >>> diagnoser = make_diagnoser(sampling_rate=10_000).fit(X, y, rpm=600)
    >>> X_500 = rng.normal(size=(2, 20_000))
    >>> X_500[1, ::333] += 20
    >>> diagnoser.predict(X_500, rpm=[500, 500])
    array(['healthy', 'worn'], dtype='<U7')
    """
    if bearing is not None and sampling_rate is None:
        raise ValueError(
            f"The bearing {bearing!r} needs a sampling rate: pass sampling_rate in Hz."
        )
    residual = window_comparison(n_jobs)
    if sampling_rate is not None:
        orders = OrderResidual(sampling_rate=sampling_rate, n_jobs=n_jobs)
        residual = StretchResidual(window_residual=residual, order_residual=orders)
    decide = ConditionClassifier(
        residual=residual, healthy=healthy, locations=locations
    )
    if bearing is not None:
        options = {"bearing": bearing, "sampling_rate": sampling_rate, "n_jobs": n_jobs}
        decide = FaultOrderClassifier(locations=locations, conditions=decide, **options)
    identify = ARXLaguerre(order=MODEL_ORDER, bank=False, n_jobs=n_jobs)
    steps = [("identify", identify), ("decide", decide)]
    return DiagnosisPipeline(steps, n_jobs=n_jobs, **pipeline)


def make_detector(
    *,
    false_alarm_rate: float = 0.01,
    fixed_gain: bool = False,
    n_jobs: int | None = None,
    **pipeline: Any,
) -> DiagnosisPipeline:
    """Detection at any speed from healthy recordings alone.

    One model takes out what measured inputs explain; `FaultDetector` compares the rest
    with what it expects at the speed. Rows are windows of some thousand samples or,
    better, stretches of a second. Healthy rows of several speeds make it sharper at all
    others.

    Parameters
    ----------
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy rows that may be flagged.
    fixed_gain : bool, default=False
        Whether all recordings have the same sensor, mounting and amplification, so that
        a change of the level shows a change of the machine.
    n_jobs : int or None, default=None
        Threads that work on windows.
    **pipeline
        Other parameters of `DiagnosisPipeline`: `memory` and `verbose`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify" and "decide".

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> rng = np.random.default_rng(0)
    >>> def healthy(n, rpm):
    ...     return rpm * lfilter([1], [1, -0.5 - rpm / 5000], rng.normal(size=(n, 4800)))
    >>> X = np.concatenate([healthy(60, 800), healthy(60, 1200)])
    >>> detector = make_detector().fit(X, rpm=np.repeat([800, 1200], 60))
    >>> faulty = healthy(3, 1000)
    >>> faulty[:, ::600] += 50_000
    >>> detector.predict(faulty, rpm=1000)
    array([-1, -1, -1])
    """
    decide = FaultDetector(
        false_alarm_rate=false_alarm_rate, fixed_gain=fixed_gain, n_jobs=n_jobs
    )
    return _behind_model(decide, pipeline, unit_rms=False)


def make_known_conditions(
    *, false_rejection_rate: float = 0.01, n_jobs: int | None = None, **pipeline: Any
) -> DiagnosisPipeline:
    """Make an outlier detector that rejects windows unlike every known condition.

    One model of all conditions takes out what measured inputs explain;
    `KnownConditions` compares the rest with the limits of each condition. Fit it on the
    same windows and conditions as the diagnoser, and on their speeds.

    Parameters
    ----------
    false_rejection_rate : float, default=0.01
        Share in (0, 1) of windows of a known condition that may be rejected.
    n_jobs : int or None, default=None
        Threads that work on windows.
    **pipeline
        Other parameters of `DiagnosisPipeline`: `memory` and `verbose`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify" and "decide".

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(202, 4800))
    >>> X = np.concatenate(
    ...     [lfilter([1], [1, -0.8], noise[:100]), lfilter([1], [1, 0.8], noise[100:200])]
    ... )
    >>> y = np.repeat(["good", "worn"], 100)
    >>> known = make_known_conditions()
    >>> with warnings.catch_warnings(action="ignore"):  # one speed
    ...     _ = known.fit(X, y, rpm=1000)
    >>> known.predict(noise[200:], rpm=1000)  # white noise is neither
    array([-1, -1])
    """
    decide = KnownConditions(false_rejection_rate=false_rejection_rate, n_jobs=n_jobs)
    return _behind_model(decide, pipeline)


def make_fault_order_classifier(
    *,
    bearing: BearingLike | Sequence[BearingLike],
    sampling_rate: float,
    n_jobs: int | None = None,
    **options: Any,
) -> DiagnosisPipeline:
    """Make a classifier that names faults without recordings of them, behind a model.

    The model removes what can be predicted of the signal, such as loud resonances;
    impacts stay in its innovations. It needs no labels: fit it on the very rows that
    are to be diagnosed.

    Parameters
    ----------
    bearing : BearingLike or sequence of BearingLike
        The bearing, as in `FaultOrderClassifier`.
    sampling_rate : float
        In Hz.
    n_jobs : int or None, default=None
        Threads that work on rows.
    **options
        Other parameters of `FaultOrderClassifier`.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify" and "decide".

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(2, 20_000))
    >>> impacts = np.cumsum(20_000 / (15 * 3.585) * rng.normal(1, 0.01, size=53)).astype(int)
    >>> X[1, impacts] += 10                          # the outer race of a bearing 6205 at 900 rpm
    >>> classifier = make_fault_order_classifier(bearing="6205", sampling_rate=20_000)
    >>> classifier.fit(X).predict(X, rpm=900)
    array(['healthy', 'outer'], dtype='<U7')
    """
    options |= {"bearing": bearing, "sampling_rate": sampling_rate, "n_jobs": n_jobs}
    return _behind_model(FaultOrderClassifier(**options), {})


def _behind_model(decide, pipeline, **options):
    """Put a decision behind one model of all rows."""
    identify = ARXLaguerre(
        order=_DETECTOR_ORDER, bank=False, n_jobs=decide.n_jobs, **options
    )
    steps = [("identify", identify), ("decide", decide)]
    return DiagnosisPipeline(steps, n_jobs=decide.n_jobs, **pipeline)
