"""Proportional-integral observers: from innovations to residual levels."""

from numbers import Integral, Real

import numpy as np
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils import Bunch, check_scalar, gen_batches
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import check_is_fitted, validate_data

from .kernels import evaluation as evaluate
from .kernels import observer
from .kernels.pole_search import frequency_grid
from .kernels.scaling import root_mean_square
from .validation import check_input_names

_EVALUATIONS = ("power", "switching_gain", "whiteness")
#: Windows in one unit of parallel work.
_BATCH = 64
#: Cells of (0, pi) on which a log spectrum is taken; its 64 filters resolve a quarter of them.
_N_FREQUENCIES = 256
_RIDGE = 1e-6


class _Observer(TransformerMixin, BaseEstimator):
    """What both observers share: validation, evaluation, trajectories."""

    def fit(self, X, y=None):
        """Certify that the observer is stable.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations, or windows, which are the innovations of a model that predicts nothing.
        y : ignored
            Here by convention.

        Returns
        -------
        estimator
            The fitted observer.

        Raises
        ------
        ValueError
            If a parameter is out of its range or the gains are unstable; the message has the
            numbers.
        """
        self._validate(X, reset=True)
        self._check_parameters()
        self._certify()
        return self

    def transform(self, X):
        """One residual level for each window and model.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        ndarray of shape (n_windows, n_models) or (n_windows, 2 * n_models)
            Residual levels; then, with ``fault_estimate=True``, the levels of the fault estimates.
        """
        innovations = self._validate(X, reset=False)
        parts = Parallel(n_jobs=self.n_jobs, prefer="threads")(
            delayed(self._levels)(innovations[batch])
            for batch in gen_batches(len(innovations), _BATCH)
        )
        return np.concatenate(parts).astype(innovations.dtype, copy=False)

    def _levels(self, innovations):
        n_windows, n_models, _ = innovations.shape
        error, fault_estimate = self._observe(innovations)
        if self.evaluation == "power":
            level = root_mean_square(error)
        elif self.evaluation == "switching_gain":
            surface = evaluate.sliding_surface(error, self.sliding_slope)
            level = evaluate.settled_level(evaluate.switching_gain(surface, self.adaptation_step))
        else:
            level = self._whiteness(error)
        levels = level.reshape(n_windows, n_models)
        if self.fault_estimate:
            estimated = root_mean_square(fault_estimate).reshape(n_windows, n_models)
            levels = np.concatenate([levels, estimated], axis=1)
        return levels

    def _observe(self, innovations):
        signals = innovations.reshape(-1, innovations.shape[-1]).astype(np.float64)
        return observer.observe(signals, *self._loop_constants())

    def _whiteness(self, error):
        frequency = frequency_grid(_N_FREQUENCIES)
        rms = root_mean_square(error)[:, np.newaxis]
        unit = np.divide(error, rms, out=np.zeros_like(error), where=rms > 0)
        spectra = evaluate.log_spectrum(unit, self.spectrum_order, 0.0, _RIDGE, frequency)
        spectra -= 2 * np.log(np.abs(self._response(frequency)))
        return evaluate.cepstral_distance(spectra, self.quefrency_exponent)

    def _response(self, frequency):
        """Small-signal response from innovations to the output error."""
        pole, kp, ki = self._small_signal_gains()
        z = np.exp(1j * frequency)
        if ki == 0:
            return (z - pole) / (z - pole + kp)
        return (z - pole) * (z - 1) / ((z - pole + kp) * (z - 1) + ki)

    def observe(self, X):
        r"""Trajectories, for looking at them.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        Bunch
            Arrays shaped like X, in its unit: ``error`` e; ``fault_estimate``, the estimate before
            each sample; ``sliding_surface`` :math:`S = \lambda e + (e(k) - e(k-1))`;
            ``switching_gain`` K_s; ``residual``, :math:`r = K_s\,\mathrm{sgn}(S)` or, with a
            boundary layer, :math:`r = K_s\,\mathrm{sat}(S / (\phi K_s))`.
        """
        innovations = self._validate(X, reset=False)
        shape = np.shape(X)
        error, fault_estimate = self._observe(innovations)
        surface = evaluate.sliding_surface(error, self.sliding_slope)
        gain = evaluate.switching_gain(surface, self.adaptation_step)
        layer = self.boundary_layer * gain
        saturated = np.divide(surface, layer, out=np.sign(surface), where=layer > 0)
        trajectories = {
            "error": error,
            "fault_estimate": fault_estimate,
            "sliding_surface": surface,
            "switching_gain": gain,
            "residual": gain * np.clip(saturated, -1, 1),
        }
        return Bunch(**{name: path.reshape(shape) for name, path in trajectories.items()})

    def get_feature_names_out(self, input_features=None):
        """Names of the levels: model and evaluation.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the models, as `ARXLaguerre.get_feature_names_out` gives them.

        Returns
        -------
        ndarray of str
            One name a column of what `transform` returns.
        """
        check_is_fitted(self)
        names = check_input_names(self, input_features)
        if self.n_models_ == 0:
            prefixes = [""]
        elif names is None:
            prefixes = [f"model{c}_" for c in range(self.n_models_)]
        else:
            prefixes = [f"{name}_" for name in names]
        kinds = [self.evaluation] + ["fault_estimate"] * self.fault_estimate
        return np.array([prefix + kind for kind in kinds for prefix in prefixes], dtype=object)

    def _validate(self, X, *, reset):
        if not reset:
            check_is_fitted(self)
        X = validate_data(self, X, dtype=[np.float64, np.float32], allow_nd=True, reset=reset)
        if X.ndim > 3:
            raise ValueError(
                f"X has shape {X.shape}, expected innovations of shape (n_windows, n_models, "
                "n_samples) or windows of shape (n_windows, n_samples)."
            )
        if reset:
            self.n_models_ = X.shape[1] if X.ndim == 3 else 0
        elif (X.ndim == 3) != (self.n_models_ > 0):
            raise ValueError(
                f"X has {X.ndim} dimensions, but {type(self).__name__} was fitted on "
                f"{3 if self.n_models_ else 2}."
            )
        return X if X.ndim == 3 else X[:, np.newaxis]

    def _check_parameters(self):
        check_scalar(self.pole, "pole", Real, min_val=-1, max_val=1, include_boundaries="neither")
        check_scalar(self.kp, "kp", Real)
        if self.evaluation not in _EVALUATIONS:
            raise ValueError(
                f"evaluation == {self.evaluation!r}, must be one of {', '.join(_EVALUATIONS)}."
            )
        check_scalar(self.sliding_slope, "sliding_slope", Real, min_val=0)
        check_scalar(
            self.adaptation_step,
            "adaptation_step",
            Real,
            min_val=0,
            max_val=1,
            include_boundaries="right",
        )
        check_scalar(self.boundary_layer, "boundary_layer", Real, min_val=0)
        check_scalar(self.spectrum_order, "spectrum_order", Integral, min_val=1)
        check_scalar(self.quefrency_exponent, "quefrency_exponent", Real, min_val=0)

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags


class PIObserver(_Observer):
    r"""Linear proportional-integral observer, the baseline (Eqs. 17 and 18).

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
    sliding_slope : float, default=1.0
        Slope :math:`\lambda` of the sliding surface, at least 0.
    adaptation_step : float, default=0.02
        Step of the logarithm of the switching gain a sample, in (0, 1].
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0; it shapes the
        residual that `observe` returns.
    spectrum_order : int, default=64
        Order of the network that takes the log spectrum for "whiteness", at least 1.
    quefrency_exponent : float, default=0.5
        Exponent p of the cepstral norm for "whiteness", at least 0.
    fault_estimate : bool, default=False
        Whether the root-mean-square of each fault estimate is a further feature.
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
    >>> observer.fit(innovations).observe(innovations).fault_estimate[0, -1].round(6)
    np.float64(0.5)
    """

    def __init__(
        self,
        *,
        pole=0.3,
        kp=0.1,
        ki=0.05,
        evaluation="power",
        sliding_slope=1.0,
        adaptation_step=0.02,
        boundary_layer=0.0,
        spectrum_order=64,
        quefrency_exponent=0.5,
        fault_estimate=False,
        n_jobs=None,
    ):
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
        check_scalar(self.ki, "ki", Real, min_val=0)
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


class ExtendedStatePIObserver(_Observer):
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
    sliding_slope : float, default=1.0
        Slope :math:`\lambda` of the sliding surface, at least 0.
    adaptation_step : float, default=0.02
        Step of the logarithm of the switching gain a sample, in (0, 1].
    boundary_layer : float, default=0.0
        Half-width of the boundary layer in units of the switching gain, at least 0; it shapes the
        residual that `observe` returns.
    spectrum_order : int, default=64
        Order of the network that takes the log spectrum for "whiteness", at least 1.
    quefrency_exponent : float, default=0.5
        Exponent p of the cepstral norm for "whiteness", at least 0.
    fault_estimate : bool, default=False
        Whether the root-mean-square of each fault estimate is a further feature.
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

    def __init__(
        self,
        *,
        pole=0.3,
        kp=0.1,
        ki_a=0.025,
        ki_b=0.025,
        gain=2.0,
        exponent=1.0,
        saturation=1.0,
        evaluation="switching_gain",
        sliding_slope=1.0,
        adaptation_step=0.02,
        boundary_layer=0.0,
        spectrum_order=64,
        quefrency_exponent=0.5,
        fault_estimate=False,
        n_jobs=None,
    ):
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
        check_scalar(self.ki_a, "ki_a", Real)
        check_scalar(self.ki_b, "ki_b", Real)
        for name in ("gain", "exponent"):
            check_scalar(getattr(self, name), name, Real, min_val=0, include_boundaries="neither")
        check_scalar(self.saturation, "saturation", Real, min_val=0)
        largest = self.gain * (1 + float(self.saturation) ** self.exponent)
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
