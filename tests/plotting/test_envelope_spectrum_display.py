import numpy as np
import pytest

from skarxlag import FaultOrderClassifier, make_alpio, make_fault_order_classifier
from skarxlag.plotting import EnvelopeSpectrumDisplay

from ..bearing_rows import RATE, row


@pytest.fixture(scope="module")
def rows():
    return np.stack([row("healthy"), row("inner", rpm=918)])


def test_display_shows_the_combs_that_were_found(rows):
    classifier = FaultOrderClassifier(bearing="6205", sampling_rate=RATE).fit(rows)
    display = EnvelopeSpectrumDisplay.from_estimator(classifier, rows[1], rpm=900)
    found = classifier.match(rows[1:], rpm=900)
    np.testing.assert_allclose(
        display.line_.get_ydata(), 4.3429 * found.contrasts[0][:2001], rtol=1e-4
    )
    assert display.factors["inner"] == pytest.approx(1.02, abs=0.01)
    assert display.comb_lines_["inner"].get_xdata()[0] == pytest.approx(
        5.415 * 1.02, rel=0.01
    )
    np.testing.assert_allclose(display.dots_.get_xdata(), display.combs["inner"])
    assert display.ax_.get_title() == classifier.diagnose(rows[1:], rpm=900).evidence[0]
    assert display.ax_.get_xlabel() == "Order of the bearing's shaft"
    # 2.74 nepers, less half the logarithm of 100 over 15.3 revolutions.
    assert display.limit == pytest.approx(4.343 * 1.80, abs=0.1)


def test_a_pipeline_draws_into_given_axes(rows, ax):
    pipeline = make_fault_order_classifier(bearing="6205", sampling_rate=RATE).fit(rows)
    display = EnvelopeSpectrumDisplay.from_estimator(pipeline, rows[1], rpm=900, ax=ax)
    assert display.ax_ is ax and ax.get_xlim() == (0, 20)
    assert len(display.combs["inner"]) == 3
    assert display.comb_lines_["inner"].get_xdata()[0] == pytest.approx(
        1.02 * 5.415, rel=0.01
    )


def test_another_estimator_is_named(rows):
    other = make_alpio().fit(rows[:, :2000], ["a", "b"])
    with pytest.raises(ValueError, match="Last step: ThresholdLadder"):
        EnvelopeSpectrumDisplay.from_estimator(other, rows[0, :2000])
