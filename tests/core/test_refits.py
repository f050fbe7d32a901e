"""An interrupted refit leaves an estimator as it was."""

import sys

import numpy as np
import pytest

from skarxlag import ARXLaguerre, ThresholdLadder, make_alpio, make_diagnoser


class Interruption:
    """Context that raises KeyboardInterrupt at a call of a function."""

    def __init__(self, after):
        self.left = after

    def __enter__(self):
        sys.setprofile(self._count)

    def __exit__(self, *error):
        sys.setprofile(None)

    def _count(self, frame, event, _):
        name = frame.f_globals.get("__name__", "")
        if event == "call" and name.startswith(("skarxlag.core", "sklearn")):
            self.left -= 1
            if self.left == 0:
                sys.setprofile(None)
                raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("estimator", "shape"),
    [
        (ARXLaguerre(order=4), (24, 300)),
        (ThresholdLadder(), (24, 2)),
        (make_alpio(), (24, 300)),
        (make_diagnoser(), (24, 300)),
    ],
    ids=["transformer", "classifier", "pipeline", "diagnoser"],
)
def test_an_interrupted_refit_changes_nothing(estimator, shape):
    rng = np.random.default_rng(0)
    y = np.repeat(["good", "worn"], 12)
    first, second = rng.normal(size=(2, *shape))
    first[12:] = first[12:].cumsum(axis=1)
    second[:12] = second[:12].cumsum(axis=1)
    method = "predict_proba" if hasattr(estimator, "predict_proba") else "transform"

    def outputs():
        return getattr(estimator, method)(first)

    new = getattr(estimator.fit(second, y), method)(first)
    old = getattr(estimator.fit(first, y), method)(first)
    assert not np.allclose(old, new)
    n_interrupted = 0
    for after in np.unique(np.geomspace(1, 3000, 12).astype(int)):
        try:
            with Interruption(after):
                estimator.fit(second, y)
        except KeyboardInterrupt:
            n_interrupted += 1
            np.testing.assert_array_equal(outputs(), old)
        else:
            break
    assert n_interrupted > 3
    np.testing.assert_array_equal(getattr(estimator.fit(second, y), method)(first), new)
