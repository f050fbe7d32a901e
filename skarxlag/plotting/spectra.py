"""Plots of the envelope and order spectra of one row, with the orders of faults."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline

from ..core.capabilities import offers, unfolded_steps
from ..core.state import expect
from ..decisions.order_comparison import order_comparison
from ..kernels.fault_orders import FAULTS, N_MULTIPLES, NEPER_IN_DB, ORDER_STEP
from ..measures.envelope_spectra import impact_orders
from ._fitted import known_conditions
from ._style import (
    LINE,
    NEUTRAL,
    Axes,
    AxesDisplay,
    Display,
    condition_styles,
    ink,
    legend_beside,
)

#: Highest order that is shown: three multiples of the inner ring of common bearings.
_HIGHEST_ORDER = 20.0
#: Multiples of the order of each fault that are marked. Repeated impacts of a fault
#: show at multiples of its order; those of the rings are the strongest.
_MULTIPLES = {"shaft": 1, "cage": 1, "outer": 3, "inner": 3, "ball": 2}
#: Abbreviations of the fault orders in the field.
_ABBREVIATIONS = {"cage": "FTF", "outer": "BPFO", "inner": "BPFI", "ball": "2 BSF"}
#: Nearest conditions that are shown: the verdict and its closest rival.
_N_SHOWN = 2


@dataclass(repr=False, eq=False)
class EnvelopeSpectrumDisplay(AxesDisplay):
    """Plot the contrast of envelope spectra over orders, with the combs of the faults.

    The line shows how far the envelope spectra rise above their surroundings. The first
    four multiples of the order of each fault (BPFO, BPFI and 2 BSF) are marked, at the
    speed and slip that fit the fault best. The comb of the fault with the largest score
    is marked by dots, too.

    Parameters
    ----------
    orders : ndarray of shape (n_orders,)
        Orders, in multiples of the speed of the bearing's shaft.
    contrast : ndarray of shape (n_orders,)
        Contrast in dB.
    combs : dict of str to ndarray of shape (n_multiples,)
        Orders of the marked lines of "ball", "inner" and "outer".
    scores : dict of str to float
        Score of each fault in dB.
    factors : dict of str to float
        True over nominal order of each fault.
    limit : float
        Largest score of a healthy row in dB.
    evidence : str
        Sentence above the plot.

    Attributes
    ----------
    ax_, figure_ : matplotlib Axes, and Figure
        The axes and the figure.
    line_ : matplotlib Line2D
        The contrast.
    comb_lines_ : dict of str to matplotlib Line2D
        First line of each comb.
    dots_ : matplotlib Line2D
        Dots on the strongest comb.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import FaultOrderClassifier
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(1, 20_000))
    >>> X[0, np.cumsum(rng.normal(246, 2, size=80)).astype(int)] += 10
    >>> classifier = FaultOrderClassifier(bearing="6205", sampling_rate=20_000).fit(X)
    >>> display = EnvelopeSpectrumDisplay.from_estimator(classifier, X[0], rpm=900)
    >>> max(display.scores, key=display.scores.get)
    'inner'
    """

    orders: NDArray[Any]
    contrast: NDArray[Any]
    _: KW_ONLY
    combs: dict[str, Any]
    scores: dict[str, float]
    factors: dict[str, float]
    limit: float
    evidence: str

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        row: ArrayLike,
        *,
        rpm: ArrayLike | None = None,
        ax: Axes | None = None,
    ) -> Self:
        """Compute the combs of one row and plot them.

        Parameters
        ----------
        estimator : FaultOrderClassifier or Pipeline
            Fitted classifier, or a pipeline that ends with one.
        row : array-like of shape (n_samples,) or (n_channels, n_samples)
            The row.
        rpm : float, array-like of shape (n_samples,) or None, default=None
            Nominal speed in revolutions per minute; None only if the classifier
            searches the speed.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        EnvelopeSpectrumDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the last step is no FaultOrderClassifier.
        """
        *before, classifier = unfolded_steps(estimator)
        matches_combs = offers(classifier, "match")
        expect(matches_combs, "Last step", classifier, "a FaultOrderClassifier")
        X = np.asarray(row)[np.newaxis]
        for step in before:
            X = step.transform(X)
        speed = rpm if np.ndim(rpm) == 0 else np.asarray(rpm)[np.newaxis]
        matches = classifier.match(X, rpm=speed)
        factors = matches.factors[0]
        orders = impact_orders(classifier.orders_)[
            matches.bearings[0], np.arange(len(FAULTS))
        ]
        lines = np.outer(orders * factors, np.arange(1, N_MULTIPLES + 1))
        diagnosed = classifier.diagnose(X, rpm=speed)
        n_shown = int(_HIGHEST_ORDER / ORDER_STEP) + 1
        return cls(
            np.arange(n_shown) * ORDER_STEP,
            NEPER_IN_DB * matches.contrasts[0][:n_shown],
            combs={
                name: multiples[multiples <= _HIGHEST_ORDER]
                for name, multiples in zip(FAULTS, lines, strict=True)
            },
            scores=_by_fault(NEPER_IN_DB * matches.scores[0]),
            factors=_by_fault(factors),
            limit=NEPER_IN_DB * float(diagnosed.comb_limit[0]),
            evidence=diagnosed.evidence[0],
        ).plot(ax)

    def _draw(self, ax):
        self.line_: Any = ax.plot(
            self.orders, self.contrast, color=ink(), linewidth=0.8, label="contrast"
        )[0]
        styles = condition_styles(["healthy", *FAULTS])
        self.comb_lines_: dict[str, Any] = {}
        for name, orders in self.combs.items():
            error = 100 * (self.factors[name] - 1)
            label = f"{name} ({_ABBREVIATIONS[name]}): {self.scores[name]:.0f} dB, {error:+.1f} %"
            color = styles[name]["color"]
            for order in orders:
                line = ax.axvline(order, color=color, ls=":", zorder=0, label=label)
                self.comb_lines_.setdefault(name, line)
        best = max(self.scores, key=self.scores.get)
        heights = np.interp(self.combs[best], self.orders, self.contrast)
        color = styles[best]["color"]
        self.dots_: Any = ax.plot(self.combs[best], heights, "o", color=color)[0]
        label = f"limit {self.limit:.0f} dB"
        limit = ax.axhline(self.limit, color=NEUTRAL, linewidth=1, label=label)
        ax.set(
            xlabel="Order of the bearing's shaft",
            ylabel="Contrast (dB)",
            title=self.evidence,
            xlim=(0, self.orders[-1]),
            ylim=(0, None),
        )
        legend_beside(ax, [self.line_, *self.comb_lines_.values(), limit])


def _by_fault(values):
    return dict(zip(FAULTS, values.tolist(), strict=True))


@dataclass(repr=False, eq=False)
class OrderSpectrumDisplay(Display):
    r"""Plot the order spectrum of a stretch, with the references of the two nearest conditions.

    There is one panel for each of these conditions. A panel shows the spectrum of the
    envelope, averaged over the frequency bands, and the reference spectrum of the
    condition. The order axis of the spectrum uses the shaft speed that fits the
    condition best. If `fault_orders` is given, lines mark the orders of the faults,
    with the first multiples for the rings and the elements.

    Parameters
    ----------
    orders : ndarray of shape (n_orders,)
        Orders, in multiples of the shaft speed.
    spectra : dict of str to ndarray of shape (n_orders,)
        Spectrum of the stretch for each condition that is shown, in nepers of power.
        The speed is multiplied by the factor that fits the condition best. The nearest
        condition comes first.
    references : dict of str to ndarray of shape (n_orders,)
        Reference spectrum of each condition.
    factors : dict of str to float
        Factor on the speed for each condition.
    residuals : dict of str to float
        Residual of the order spectrum for each condition.
    conditions : list of str
        All conditions. Their order determines their colours.
    rpm : float or None, default=None
        Nominal speed in revolutions per minute.
    fault_orders : dict of str to float or None, default=None
        Orders of the faults, as `skarxlag.bearing_orders` returns them.

    Attributes
    ----------
    axes_, figure_ : ndarray of matplotlib Axes, and Figure
        The axes, one panel for each condition, and the figure that holds them.
    lines_ : dict of str to matplotlib Line2D
        Line of the stretch's spectrum in the panel of each condition.
    reference_lines_ : dict of str to matplotlib Line2D
        Line of the reference spectrum in the panel of each condition.
    fault_lines_ : dict of str to matplotlib Line2D
        First line of each fault, in the first panel.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import make_diagnoser
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(12, 20_000))
    >>> X[6:, ::278] += 20                           # order 3.6 of 600 rpm
    >>> y = np.repeat(["healthy", "worn"], 6)
    >>> diagnoser = make_diagnoser(sampling_rate=10_000).fit(X, y, rpm=600)
    >>> display = OrderSpectrumDisplay.from_estimator(diagnoser, X[11], rpm=600)
    >>> list(display.spectra)
    ['worn', 'healthy']
    """

    orders: NDArray[Any]
    spectra: dict[str, Any]
    references: dict[str, Any]
    _: KW_ONLY
    factors: dict[str, float]
    residuals: dict[str, float]
    conditions: list[str]
    rpm: float | None = None
    fault_orders: dict[str, float] | None = None

    @classmethod
    def from_estimator(
        cls,
        estimator: Pipeline,
        stretch: ArrayLike,
        *,
        rpm: ArrayLike | None = None,
        fault_orders: dict[str, float] | None = None,
    ) -> Self:
        """Compare one stretch with the references of a fitted diagnoser, and plot the spectra.

        Parameters
        ----------
        estimator : Pipeline
            Fitted pipeline with a step `StretchResidual` or `OrderResidual`, such as
            `make_diagnoser` returns.
        stretch : array-like of shape (n_samples,) or (n_channels, n_samples)
            The stretch.
        rpm : float, array-like of shape (n_samples,) or None, default=None
            Nominal shaft speed of the stretch, in revolutions per minute.
        fault_orders : dict of str to float or None, default=None
            Orders to mark, as `skarxlag.bearing_orders` returns them.

        Returns
        -------
        OrderSpectrumDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If no step of the pipeline compares order spectra.
        """
        before, residual = order_comparison(estimator)
        row = np.asarray(stretch)[np.newaxis]
        levels = row if before is None else before.transform(row)
        speed = None if rpm is None else np.asarray(rpm)[np.newaxis]
        matches = residual.match(levels, rpm=speed)
        nearest = matches.residuals[0].argsort()[:_N_SHOWN]
        names = residual.classes_.astype(str)

        def by_name(values):
            return {str(names[c]): values[c] for c in nearest}

        return cls(
            residual.orders_,
            by_name(matches.spectra[0].mean(axis=1)),
            by_name(residual.references_.mean(axis=1)),
            factors=by_name(matches.factors[0].astype(float)),
            residuals=by_name(matches.residuals[0].astype(float)),
            conditions=known_conditions(estimator),
            rpm=None if rpm is None else float(np.mean(rpm)),
            fault_orders=fault_orders,
        ).plot()

    def plot(self) -> Self:
        """Draw the plot into a new figure.

        Returns
        -------
        OrderSpectrumDisplay
            The display, after drawing.
        """
        self._set_axes(None, len(self.spectra))
        styles = condition_styles(self.conditions)
        self.lines_: dict[str, Any] = {}
        self.reference_lines_: dict[str, Any] = {}
        self.fault_lines_: dict[str, Any] = {}
        for ax, (name, spectrum) in zip(self.axes_, self.spectra.items(), strict=True):
            style = {key: styles[name][key] for key in LINE}
            (self.reference_lines_[name],) = ax.plot(
                self.orders,
                self.references[name],
                label=f"reference of {name}",
                **style,
            )
            (self.lines_[name],) = ax.plot(
                self.orders, spectrum, color=ink(), linewidth=1, label="this stretch"
            )
            fault_lines = self._draw_fault_orders(ax)
            self.fault_lines_ = self.fault_lines_ or fault_lines
            speed = f"speed {self.factors[name]:.3g} times that of the training"
            if self.rpm is not None:
                speed = f"{self.rpm * self.factors[name]:.4g} rpm found at nominal {self.rpm:g} rpm"
            title = f"{name}: residual {self.residuals[name]:.2f}, {speed}"
            ax.set(ylabel="Power (neper)", title=title)
            lines = [self.lines_[name], self.reference_lines_[name]]
            legend_beside(ax, [*lines, *fault_lines.values()])
        ax.set(xlabel="Order of the shaft", xlim=(0, self.orders[-1]))
        return self

    def _draw_fault_orders(self, ax):
        """Draw the orders of the faults, and return the first line of each fault."""
        fault_orders = self.fault_orders or {}
        faults = [fault for fault in _MULTIPLES if fault in fault_orders]
        first_lines = {}
        for number, fault in enumerate(faults, start=1):
            order = fault_orders[fault]
            name = f"{fault} ({_ABBREVIATIONS[fault]})" if fault != "shaft" else fault
            lines = order * np.arange(1, _MULTIPLES[fault] + 1)
            for position in lines[lines <= self.orders[-1]]:
                line = ax.axvline(
                    position,
                    color=NEUTRAL,
                    linestyle=(0, (number, 2)),
                    linewidth=1,
                    label=f"{name} {order:.3g}",
                    zorder=0,
                )
                first_lines.setdefault(fault, line)
        return first_lines
