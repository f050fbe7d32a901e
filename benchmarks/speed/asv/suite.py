"""Main rows of `benchmarks.speed` for airspeed velocity.

One thread and float64 everywhere; the first call, which compiles, is in `setup`.
"""

# ruff: noqa: D102
import numpy as np
from scipy.signal import lfilter

import skarxlag

N_WINDOWS, N_SAMPLES = 800, 1200
MAKERS = ("make_alpio", "make_extended_state_pio", "make_diagnoser")


def coloured_windows(n_conditions):
    """Return windows of noise, with a spectral shape for each condition, and the conditions."""
    windows = np.random.default_rng(0).normal(size=(N_WINDOWS, N_SAMPLES))
    y = np.arange(N_WINDOWS) % n_conditions
    for condition, pole in enumerate(np.linspace(-0.8, 0.8, n_conditions)):
        windows[y == condition] = lfilter([1], [1, -pole], windows[y == condition])
    return windows, y


class Bank:
    """Eight models of order 16, and the observer behind them."""

    def setup(self):
        self.X, self.y = coloured_windows(8)
        self.identify = skarxlag.ARXLaguerre(order=16).fit(self.X, self.y)
        self.innovations = self.identify.transform(self.X)
        observer = skarxlag.ExtendedStatePIObserver(n_observers=1)
        self.observe = observer.fit(self.innovations)
        self.observe.transform(self.innovations[:8])

    def time_fit(self):
        self.identify.fit(self.X, self.y)

    def time_innovations(self):
        self.identify.transform(self.X)

    def time_observer(self):
        self.observe.transform(self.innovations)


class Diagnoser:
    """Whole pipelines."""

    params = MAKERS
    param_names = ("maker",)

    def setup(self, maker):
        self.X, self.y = coloured_windows(4)
        self.diagnoser = getattr(skarxlag, maker)().fit(self.X, self.y)
        self.diagnoser.predict(self.X[:8])

    def time_fit(self, maker):
        self.diagnoser.fit(self.X, self.y)

    def time_predict(self, maker):
        self.diagnoser.predict(self.X)

    def peakmem_predict(self, maker):
        self.diagnoser.predict(self.X)


class Identification:
    """Two channels, 8+8 coefficients, with given poles and with a search."""

    params = (0.3, "optimise")
    param_names = ("pole",)

    def setup(self, pole):
        u, _ = coloured_windows(1)
        y = lfilter([0, 0.5, 0.3], [1, -1.5, 0.7], u)
        self.X = np.stack([y, u], axis=1)
        self.model = skarxlag.ARXLaguerre(order=8, pole=pole).fit(self.X)

    def time_fit(self, pole):
        self.model.fit(self.X)


class StartUp:
    """The first verdict in a fresh process."""

    params = MAKERS
    param_names = ("maker",)
    number = 1

    def timeraw_first_prediction(self, maker):
        return f"""
        import numpy as np
        import skarxlag
        X = np.random.default_rng(0).normal(size=(40, 1200))
        skarxlag.{maker}().fit(X, np.arange(40) % 4).predict(X)
        """
