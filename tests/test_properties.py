"""Properties of any windows that hypothesis tries to refute.

``SKARXLAG_EXAMPLES=500 python -m pytest tests/test_properties.py`` tries more, and
other ones each time.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio
from tests.damage import some_examples

MAKERS = [make_alpio, make_extended_state_pio, make_diagnoser]


def recordings(seed, n_windows=24, n_samples=256):
    """Windows of three conditions that differ in colour, and their conditions."""
    rng = np.random.default_rng(seed)
    y = np.arange(n_windows) % 3
    noise = rng.normal(size=(n_windows, n_samples))
    X = np.stack(
        [lfilter([1.0], [1.0, 0.8 * (c - 1)], w) for c, w in zip(y, noise, strict=True)]
    )
    return X, y


@pytest.fixture(scope="module", params=MAKERS, ids=lambda make: make.__name__)
def fitted(request):
    return request.param().fit(*recordings(0))


seeds = st.integers(0, 2**32 - 1)


@some_examples
@given(
    seeds,
    st.floats(1e-300, 1e290),
    st.sampled_from([1.0, -1.0]),
    st.floats(-1e3, 1e3),
)
def test_unit_and_offset_of_the_sensor_do_not_matter(
    fitted, seed, factor, sign, offset
):
    X, _ = recordings(seed)
    np.testing.assert_allclose(
        fitted.predict_proba(sign * factor * (X + offset)),
        fitted.predict_proba(X),
        rtol=1e-4,
        atol=1e-6,
    )


@some_examples
@given(seeds, st.randoms(use_true_random=False))
def test_neither_order_nor_number_of_windows_matters(fitted, seed, random):
    X, _ = recordings(seed, n_windows=70)
    order = random.sample(range(len(X)), len(X))
    expected = fitted.predict_proba(X)[order]
    np.testing.assert_array_equal(fitted.predict_proba(X[order]), expected)
    alone = fitted.predict_proba(X[order[:1]])
    np.testing.assert_array_equal(alone, expected[:1])


@pytest.mark.slow
@some_examples
@given(
    st.sampled_from(MAKERS),
    st.lists(
        st.integers(-100, 100) | st.none(), min_size=3, max_size=3, unique=True
    ).filter(lambda names: None not in names)
    | st.lists(st.text("ab Ü0", min_size=1, max_size=4), min_size=3, max_size=3, unique=True),
    st.randoms(use_true_random=False),
)  # fmt: skip
def test_names_of_conditions_and_order_of_training_do_not_matter(make, names, random):
    X, y = recordings(1)
    expected = make().fit(X, y).predict_proba(X)
    order = random.sample(range(len(X)), len(X))
    renamed = make().fit(X[order], np.array(names)[y][order])
    column = [renamed.classes_.tolist().index(name) for name in names]
    np.testing.assert_allclose(
        renamed.predict_proba(X)[:, column], expected, rtol=1e-4, atol=1e-6
    )
