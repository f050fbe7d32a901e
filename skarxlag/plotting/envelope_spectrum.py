"""Plot of the contrast of a row's envelope spectra, with the combs of the faults."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline

from .._answers import unfolded_steps
from ..fault_classifier import FaultOrderClassifier
from ..kernels.fault_orders import NEPER_IN_DB, ORDER_STEP, PLACES, RACE_MULTIPLES
from ._style import NEUTRAL, Display, condition_styles, ink, legend_beside

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Highest order that is shown: three multiples of the inner ring of common bearings.
_HIGHEST_ORDER = 20.0


@dataclass(repr=False, eq=False)
class EnvelopeSpectrumDisplay(Display):
    """Plot the contrast of envelope spectra over orders, with the combs of the faults.

    The line shows how far the envelope spectra rise above their surroundings. The first three
    multiples of the order of each place are marked, at the speed and slip that fit the place best.
    The comb of the place with the largest score is marked by dots, too.

    Parameters
    ----------
    orders : ndarray of shape (n_orders,)
        Orders, in multiples of the shaft speed.
    contrast : ndarray of shape (n_orders,)
        Contrast in dB.
    combs : dict of str to ndarray of shape (n_multiples,)
        Orders of the marked lines of "ball", "inner" and "outer".
    scores : dict of str to float
        Score of each place in dB.
    factors : dict of str to float
        True over nominal order of each place.
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
        estimator: FaultOrderClassifier | Pipeline,
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
            Nominal speed in revolutions per minute; None only if the classifier searches the
            speed.
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
        *before, classifier = [step for _, step in unfolded_steps(estimator)]
        if not isinstance(classifier, FaultOrderClassifier):
            raise ValueError(
                f"the last step is a {type(classifier).__name__}, expected FaultOrderClassifier."
            )
        X = np.asarray(row)[np.newaxis]
        for step in before:
            X = step.transform(X)
        found = classifier.match(X, rpm=rpm if np.ndim(rpm) == 0 else np.asarray(rpm)[np.newaxis])
        n_shown = int(_HIGHEST_ORDER / ORDER_STEP) + 1
        factors, combs = dict(zip(PLACES, found.factors[0].tolist(), strict=True)), {}
        for place, name in enumerate(PLACES):
            order = classifier.orders_[found.bearings[0, place]][1 + place] * factors[name]
            lines = order * (2 if name == "ball" else 1) * np.arange(1, RACE_MULTIPLES + 1)
            combs[name] = lines[lines <= _HIGHEST_ORDER]
        display = cls(
            np.arange(n_shown) * ORDER_STEP,
            NEPER_IN_DB * found.contrasts[0][:n_shown],
            combs=combs,
            scores=dict(zip(PLACES, (NEPER_IN_DB * found.scores[0]).tolist(), strict=True)),
            factors=factors,
            limit=NEPER_IN_DB * float(classifier.limit_ + classifier.reference_.max()),
            evidence=classifier._judge(found).evidence[0],
        )
        return display.plot(ax)

    def plot(self, ax: Axes | None = None) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        EnvelopeSpectrumDisplay
            The display, after drawing.
        """
        (ax,) = self._set_axes(ax)
        style = {"color": ink(), "linewidth": 0.8, "label": "contrast"}
        self.line_: Any = ax.plot(self.orders, self.contrast, **style)[0]
        styles = condition_styles(["healthy", *PLACES])
        self.comb_lines_: dict[str, Any] = {}
        for name, lines in self.combs.items():
            label = f"{name}: {self.scores[name]:.0f} dB, {100 * (self.factors[name] - 1):+.1f} %"
            style = {"color": styles[name]["color"], "linestyle": ":", "zorder": 0, "label": label}
            for order in lines:
                self.comb_lines_.setdefault(name, ax.axvline(order, **style))
        best = max(self.scores, key=self.scores.get)
        heights = np.interp(self.combs[best], self.orders, self.contrast)
        self.dots_: Any = ax.plot(self.combs[best], heights, "o", color=styles[best]["color"])[0]
        style = {"color": NEUTRAL, "linewidth": 1, "label": f"limit {self.limit:.0f} dB"}
        limit = ax.axhline(self.limit, **style)
        ax.set(
            xlabel="Order of the shaft",
            ylabel="Contrast (dB)",
            title=self.evidence,
            xlim=(0, self.orders[-1]),
            ylim=(0, None),
        )
        legend_beside(ax, [self.line_, *self.comb_lines_.values(), limit])
        return self
