"""No fitted state that `fit` could not have made reaches a compiled loop."""

import copy
import warnings

import numpy as np
import pytest
from sklearn.base import clone

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio
from skarxlag._state import check_pipeline_state, check_state
from tests.test_common import ESTIMATORS, labels, outputs, signals

with warnings.catch_warnings():
    # A detector says that it has few windows.
    warnings.simplefilter("ignore", UserWarning)
    FITTED = [clone(e).fit(signals((12, 40)), labels(12)) for e in ESTIMATORS]
#: One of each class is enough where the class decides.
OF_EACH_CLASS = list({type(fitted): fitted for fitted in FITTED}.values())
TABLE = signals((12, 40))


def tampered(value):
    """What somebody may put in place of a fitted attribute: name of the case, and the value."""
    yield "nothing", None
    yield "text", "nonsense"
    if isinstance(value, np.ndarray) and value.size == 0:
        yield "row more", np.ones(3)
    elif isinstance(value, np.ndarray):
        yield "empty", value[:0]
        yield "row more", np.concatenate([value, value[-1:]])
        yield "row less", value[:-1]
        yield "axis more", value[np.newaxis]
        yield "scalar", value.flat[0]
        yield "list", value.tolist()
        yield "objects", np.array([object()] * value.size).reshape(value.shape)
        if value.ndim > 1:
            yield "column more", np.concatenate([value, value[..., -1:]], axis=-1)
            yield "no column", value[..., :0]
        if value.dtype.kind == "f":
            for entry in (np.nan, np.inf, -np.inf):
                yield str(entry), np.full_like(value, entry)
            yield "complex", value.astype(complex)
            yield "foreign bytes", value.astype(value.dtype.newbyteorder())
        if value.dtype.kind in "iu":
            for entry in (-5, 0, 10**6, 2**62):
                yield str(entry), np.full_like(value, entry)
            yield "real", value + 0.5
    else:
        yield "array", np.array([value, value])
        yield "nan", float("nan")
        yield "infinite", float("inf")
        if isinstance(value, int):
            yield "huge", 10**9
            yield "real", value + 0.5


def learnt(estimator):
    return {k: v for k, v in vars(estimator).items() if k.endswith("_")}


CASES = [
    pytest.param(fitted, name, value, id=f"{type(fitted).__name__}-{name}-{case}")
    for fitted in OF_EACH_CLASS
    for name, original in learnt(fitted).items()
    for case, value in tampered(original)
    # A plain table may have any number of columns, a condition may be called by any number, and
    # a count of what was seen in `fit` may be large.
    if (name, case)
    not in {("classes_", "real"), *((f"n_{n}_", "huge") for n in ("features_in", "rows", "blocks"))}
]
#: Attributes, and values for them that are plausible by themselves but not in their place.
OUT_OF_RANGE = {
    "poles_": [1.5, 1.0, -1.0, 1.0000001],
    "coef_": [1e300],
    "noise_level_": [-1.0],
    "weights_": [-1.0],
    "detection_threshold_": [-1.0],
    "confidence_scale_": [-1.0, 0.0],
    "healthy_index_": [-1, 2],
    "spectral_radius_": [1.0, -0.1],
    "whitener_": [1e300],
}


def refused(fitted, name, value):
    estimator = copy.deepcopy(fitted)
    setattr(estimator, name, value)
    messages = []
    for call in (check_state, lambda e: outputs(e, TABLE)):
        with pytest.raises(ValueError) as caught:
            call(estimator)
        messages.append(str(caught.value))
    # Of two attributes that contradict each other either may be named.
    names = learnt(fitted) if name != "_parameters" else [name]
    return all(any(n in message for n in names) for message in messages), messages


@pytest.mark.parametrize(("fitted", "name", "value"), CASES)
def test_tampered_attribute_is_refused_by_name(fitted, name, value):
    named, messages = refused(fitted, name, value)
    assert named, messages


@pytest.mark.parametrize(
    ("fitted", "name", "value"),
    [
        (fitted, name, value)
        for name, values in OUT_OF_RANGE.items()
        for fitted in OF_EACH_CLASS
        for value in values
        if hasattr(fitted, name)
    ],
)
def test_value_out_of_range_is_refused_by_name(fitted, name, value):
    original = getattr(fitted, name)
    value = np.full_like(original, value) if isinstance(original, np.ndarray) else value
    named, messages = refused(fitted, name, value)
    assert named, messages


def test_small_array_changed_in_place_is_seen():
    model = copy.deepcopy(FITTED[0])
    model.transform(TABLE)
    model.orders_[0] = 10**6
    with pytest.raises(ValueError, match="coef_ has shape"):
        model.transform(TABLE)


@pytest.mark.parametrize("estimator", FITTED, ids=str)
def test_every_estimator_knows_a_consistent_state(estimator):
    estimator._check_state()
    check_state(copy.deepcopy(estimator))


@pytest.mark.parametrize("estimator", FITTED, ids=str)
def test_parameter_changed_after_fit_is_refused_until_the_next_fit(estimator):
    estimator = copy.deepcopy(estimator)
    expected = outputs(estimator, TABLE)
    for name, value in estimator.get_params(deep=False).items():
        if name in ("n_jobs", "healthy"):
            continue
        changed = not value if isinstance(value, bool) else 255
        estimator.set_params(**{name: changed})
        with pytest.raises(ValueError, match=f"{name} == .*fitted with {name}="):
            outputs(estimator, TABLE)
        estimator.set_params(**{name: value})
    for found, wanted in zip(outputs(estimator.set_params(), TABLE), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("entries", [None, np.array([1.0]), np.array(["alpha=1"])])
def test_note_of_the_parameters_is_checked(entries):
    model = copy.deepcopy(FITTED[0])
    model._parameters = entries
    with pytest.raises(ValueError, match=r"_parameters|alpha == 1e-06"):
        model.transform(TABLE)


MAKERS = [make_alpio, make_extended_state_pio, make_diagnoser]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("n_samples", [100, 1200])
def test_windows_of_several_channels_keep_their_length(make, n_samples):
    diagnoser = make().fit(signals((20, 2, 300)), labels(20))
    with pytest.raises(ValueError, match=r"windows of shape \(.*\), but .* was fitted on"):
        diagnoser.predict(signals((4, 2, n_samples)))


@pytest.mark.parametrize("make", MAKERS)
def test_wrong_channels_are_called_channels(make):
    diagnoser = make().fit(signals((20, 2, 300)), labels(20))
    for shape in [(4, 300), (4, 1, 300), (4, 3, 300)]:
        with pytest.raises(ValueError, match=r"fitted on windows of shape .*channels"):
            diagnoser.predict(signals(shape))


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("shape", [(40, 300, 2), (40, 1200, 2), (4, 2, 1)])
def test_more_channels_than_samples_are_transposed_windows(make, shape):
    with pytest.raises(ValueError, match=f"{shape[1]} channels.*transpose"):
        make().fit(signals(shape), labels(shape[0]))


def test_steps_must_fit_together():
    diagnoser = make_alpio().fit(signals((12, 40)), labels(12))
    check_pipeline_state(diagnoser)
    one_model = clone(diagnoser["identify"]).fit(signals((12, 40)), labels(12) * 0)
    diagnoser.steps[0] = ("identify", one_model)
    with pytest.raises(
        ValueError, match=r"Step 'observe': n_features_in_ == 2, .* gives 1 columns"
    ):
        check_pipeline_state(diagnoser)
    diagnoser["observe"].closed_loop_ = None
    with pytest.raises(ValueError, match=r"Step 'observe': closed_loop_ == None"):
        check_pipeline_state(diagnoser)
