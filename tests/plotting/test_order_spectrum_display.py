import numpy as np
import pytest

from skarxlag import bearing_orders, make_alpio, make_diagnoser
from skarxlag.bearings import SKF_6205
from skarxlag.plotting import OrderSpectrumDisplay

from ..impacts import RATE, stretches


@pytest.fixture(scope="module")
def diagnoser():
    return make_diagnoser(sampling_rate=RATE, healthy="outer").fit(
        *stretches(900), rpm=900
    )


def test_display_shows_what_the_diagnoser_compared(diagnoser):
    X, _ = stretches(600, seed=1)
    display = OrderSpectrumDisplay.from_estimator(
        diagnoser, X[0], rpm=620, fault_orders=bearing_orders(SKF_6205)
    )
    orders = diagnoser["decide"].residual_.order_residual_
    found = orders.match(diagnoser[:1].transform(X[:1]), rpm=[620])
    assert list(display.spectra) == ["inner", "outer"] == list(display.lines_)
    for c, name in enumerate(["inner", "outer"]):
        line, reference = display.lines_[name], display.reference_lines_[name]
        np.testing.assert_array_equal(line.get_xdata(), orders.orders_)
        np.testing.assert_allclose(line.get_ydata(), found.spectra[0, c].mean(axis=0))
        np.testing.assert_allclose(
            reference.get_ydata(), orders.references_[c].mean(axis=0)
        )
        assert display.residuals[name] == pytest.approx(found.residuals[0, c])
    # The speed that was found is the true one.
    assert display.rpm * display.factors["inner"] == pytest.approx(600, rel=0.015)
    title = display.axes_[0].get_title()
    assert title.startswith("inner: residual") and title.endswith("at nominal 620 rpm")
    assert display.fault_lines_["outer"].get_xdata()[0] == pytest.approx(
        3.5848, abs=1e-4
    )
    labels = [text.get_text() for text in display.axes_[0].get_legend().get_texts()]
    assert labels[:2] == ["this stretch", "reference of inner"]
    assert labels[2:] == [
        "shaft 1",
        "cage (FTF) 0.398",
        "outer (BPFO) 3.58",
        "inner (BPFI) 5.42",
        "ball (2 BSF) 4.71",
    ]
    # Multiples: three of the rings, two of the ball, below the highest order.
    assert len(display.axes_[0].lines) == 2 + 2 + 3 + 2 + 2
    # Colours by the order of conditions, the healthy one first.
    colours = [
        display.reference_lines_[name].get_color() for name in ("outer", "inner")
    ]
    assert display.conditions == ["outer", "inner"] and colours == [
        "#2aa564",
        "#6982ff",
    ]


def test_display_without_speed_and_geometry(diagnoser):
    X, _ = stretches(600, seed=1)
    display = OrderSpectrumDisplay.from_estimator(diagnoser, X[7])
    assert next(iter(display.spectra)) == "outer" and len(display.axes_) == 2
    assert display.axes_[0].get_title().endswith("times that of the training")
    assert display.fault_lines_ == {}


def test_no_order_spectra_to_show():
    X, y = stretches(900, n=1, n_samples=600)
    with pytest.raises(
        ValueError, match="expected a StretchResidual or an OrderResidual among"
    ):
        OrderSpectrumDisplay.from_estimator(make_alpio().fit(X, y), X[0])
