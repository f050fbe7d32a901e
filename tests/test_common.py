"""scikit-learn's contract, and what this package promises of every estimator beyond it."""

from collections import Counter
from functools import cache

import numpy as np
import pytest
from sklearn.base import BaseEstimator, clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils import estimator_checks, get_tags
from sklearn.utils.estimator_checks import (
    check_estimator,
    estimator_checks_generator,
    parametrize_with_checks,
)

import skarxlag
from skarxlag import (
    ARXLaguerre,
    DiagnosisPipeline,
    ExtendedStatePIObserver,
    FaultDetector,
    KnownConditions,
    LogSpectra,
    PIObserver,
    SpectralDistance,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
)
from skarxlag.core.registry import ESTIMATORS as REGISTRY

from .estimators import ESTIMATORS, labels, outputs, signals

#: Sampling noise of few rows: what the detector says of its calibration.
pytestmark = [
    pytest.mark.filterwarnings(f"ignore:{message}:UserWarning")
    for message in (
        ".* healthy rows are too few",
        ".* rows of condition .* are too few",
        "Conditions with one row at each speed",
        "All rows of condition .* have one speed",
        "rpm is not given",
        "The names of the conditions .* state no fault location",
        "y has .* labels .* but all rows count as healthy",
        "The names of the conditions .* state no fault location",
    )
]


@cache
def name_of(estimator):
    """Return the text of an estimator, which takes a while and is part of many names of tests."""
    return str(estimator)


#: One estimator of each class, and both kinds that `SensorFusion` can be: what
#: scikit-learn checks does not depend on the other parameters.
CHECKED = [*{type(e): e for e in reversed(ESTIMATORS)}.values(), ESTIMATORS[-1]]
TRANSFORMERS = [e for e in ESTIMATORS if hasattr(e, "transform")]
THREE_AXES = (ARXLaguerre, LogSpectra)
TABLES = [e for e in CHECKED if e in TRANSFORMERS and not isinstance(e, THREE_AXES)]
#: Checks that scikit-learn 1.6.1 and 1.9 make of an estimator of each type, at least.
LEAST = {"classifier": 45, "outlier_detector": 45, None: 47}
RAN = Counter()


def assert_same(one, other):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


# scikit-learn 1.6 hands over a generator, which pytest no longer likes.
CONTRACT = parametrize_with_checks(CHECKED)


@pytest.mark.parametrize(
    CONTRACT.args[0], list(CONTRACT.args[1]), ids=cache(CONTRACT.kwargs["ids"])
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)
    RAN[name_of(estimator)] += 1


def test_every_check_ran_and_none_was_skipped(request):
    planned = Counter(
        name_of(item.callspec.params["estimator"])
        for item in request.session.items
        if getattr(item, "originalname", "") == "test_scikit_learn_contract"
        and item.path == request.path
    )
    assert planned == RAN


@pytest.mark.parametrize("estimator", CHECKED, ids=name_of)
def test_number_of_checks(estimator):
    number = sum(1 for _ in estimator_checks_generator(estimator))
    assert number >= LEAST[get_tags(estimator).estimator_type]


def test_every_public_estimator_is_in_the_registry():
    public = {name: getattr(skarxlag, name) for name in skarxlag.__all__}
    assert REGISTRY.keys() == {
        name
        for name, member in public.items()
        if isinstance(member, type) and issubclass(member, BaseEstimator)
    }


def failures(estimator):
    results = check_estimator(estimator, on_fail=None, on_skip=None)
    return {r["check_name"] for r in results if r["status"] != "passed"}, len(results)


@pytest.fixture(scope="module")
def of_any_pipeline():
    # Pipeline.fit replaces its own steps, which some checks forbid whatever the steps
    # are.
    return failures(make_pipeline(StandardScaler(), ThresholdLadder()))


@pytest.mark.slow
@pytest.mark.parametrize("make", [make_alpio, make_diagnoser])
def test_diagnosers_fail_no_check_that_a_pipeline_can_pass(make, of_any_pipeline):
    inevitable, number = of_any_pipeline
    failed, n_checks = failures(make())
    assert failed <= inevitable
    assert len(inevitable) <= 2
    # The weights of windows, which a plain pipeline does not show, have checks of their own.
    assert n_checks > number >= 50


# These checks transform arrays after a fit on tables, and the other way round, on
# purpose.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:X does not have valid feature names:UserWarning")
@pytest.mark.filterwarnings("ignore:X has feature names, but:UserWarning")
@pytest.mark.parametrize("estimator", TABLES, ids=name_of)
@pytest.mark.parametrize(
    "name",
    [
        "check_transformer_get_feature_names_out",
        "check_transformer_get_feature_names_out_pandas",
        "check_set_output_transform",
        "check_set_output_transform_pandas",
        "check_set_output_transform_polars",
        "check_global_output_transform_pandas",
        "check_global_set_output_transform_polars",
        "check_dataframe_column_names_consistency",
    ],
)
def test_tables(name, estimator):
    getattr(estimator_checks, name)(type(estimator).__name__, clone(estimator))


@pytest.mark.parametrize(
    "estimator",
    [ARXLaguerre(), ThresholdLadder(), FaultDetector(), KnownConditions()],
    ids=name_of,
)
def test_column_names(estimator):
    estimator_checks.check_dataframe_column_names_consistency("it", clone(estimator))


@pytest.mark.parametrize("table", ["pandas", "polars"])
def test_identification_returns_arrays_whatever_the_setting(table):
    X = signals((6, 50))
    model = ARXLaguerre(order=3)
    assert model.set_output(transform=table) is model
    assert type(model.fit_transform(X, labels(6))) is np.ndarray
    steps = make_pipeline(ARXLaguerre(order=3), PIObserver())
    frame = steps.set_output(transform=table).fit_transform(X, labels(6))
    assert type(frame).__module__.startswith(table)


@pytest.mark.any_version
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=name_of)
class TestEveryEstimator:
    def test_fitted_attributes_are_arrays_and_plain_numbers(self, estimator):
        fitted = clone(estimator).fit(signals((12, 40)), labels(12))
        parameters = estimator.get_params()
        learnt = {k: v for k, v in vars(fitted).items() if k not in parameters}
        assert all(k.endswith("_") for k in learnt)
        # Parts that were fitted have their own turn in this test; None is a part that
        # is not used.
        parts = (type(None), DiagnosisPipeline, *(type(e) for e in ESTIMATORS))
        plain = (np.ndarray, int, float, *parts)
        values = [
            v
            for many in learnt.values()
            for v in (many if type(many) is list else [many])
        ]
        assert all(isinstance(v, plain) for v in values), learnt

    def test_float32_stays_float32(self, estimator):
        X, y = signals((12, 40)), labels(12)
        single = X.astype(np.float32)
        wide, narrow = clone(estimator).fit(X, y), clone(estimator).fit(single, y)
        if hasattr(estimator, "transform"):
            expected, levels = wide.transform(X), narrow.transform(single)
            assert (expected.dtype, levels.dtype) == (np.float64, np.float32)
            np.testing.assert_allclose(levels, expected, rtol=0.02, atol=1e-3)

    def test_memory_layout_does_not_matter(self, estimator):
        X, y = signals((12, 40)), labels(12)
        strided = np.repeat(np.repeat(X, 2, axis=0), 3, axis=1)[::2, ::3]
        expected = outputs(clone(estimator).fit(X, y), X)
        for other in (X.copy(), strided, np.asfortranarray(X)):
            other.flags.writeable = other is strided
            results = outputs(clone(estimator).fit(other, y), other)
            for a, b in zip(results, expected, strict=True):
                np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
            np.testing.assert_array_equal(other, X)

    def test_constant_windows_are_harmless(self, estimator):
        X, y = signals((12, 40)), labels(12)
        fitted = clone(estimator).fit(X, y)
        mixed, others = X.copy(), np.ones(12, dtype=bool)
        mixed[[2, 5]], others[[2, 5]] = [[0.0], [5.0]], False
        of_mixed = outputs(fitted, mixed)
        assert_same(
            [o[others] for o in of_mixed], [o[others] for o in outputs(fitted, X)]
        )
        assert all(np.isfinite(o).all() for o in of_mixed)
        for value in (0.0, 5.0):
            constant = np.full((4, 40), value)
            of_constants = clone(estimator).fit(constant, labels(4))
            assert all(np.isfinite(o).all() for o in outputs(of_constants, constant))

    @pytest.mark.parametrize("n_samples", [1, 2, 3])
    def test_short_windows(self, estimator, n_samples):
        X, y = signals((12, n_samples)), labels(12)
        assert all(np.isfinite(o).all() for o in outputs(clone(estimator).fit(X, y), X))

    def test_four_axes_are_refused(self, estimator):
        with pytest.raises(ValueError, match=r"dim|shape"):
            clone(estimator).fit(signals((4, 2, 3, 5)), labels(4))


@pytest.mark.any_version
@pytest.mark.parametrize("factor", [1e300, 1e-300, 2.0**10])
# Logarithms have no unit: how a gain moves `SpectralDistance` is tested with the
# estimator.
@pytest.mark.parametrize(
    "estimator",
    [e for e in TRANSFORMERS if not isinstance(e, SpectralDistance)],
    ids=name_of,
)
def test_scale(estimator, factor):
    X, y = signals((12, 40)), labels(12)
    if isinstance(estimator, ExtendedStatePIObserver):
        # Its nonlinearity knows an amplitude; what it gives must stay finite all the
        # same.
        X = X[:, np.newaxis]
        fitted = clone(estimator).fit(X * factor, y)
        assert np.isfinite(fitted.transform(X * factor)).all()
        return
    levels = clone(estimator).fit(X * factor, y).transform(X * factor)
    expected = clone(estimator).fit(X, y).transform(X)
    is_level = "evaluation" in estimator.get_params()
    if is_level or getattr(estimator, "unit_rms", True) is False:
        expected = expected * factor
    np.testing.assert_allclose(
        levels, expected, rtol=1e-5, atol=1e-9 * np.abs(expected).max()
    )


@pytest.mark.any_version
@pytest.mark.parametrize(
    "estimator",
    [
        e
        for e in TRANSFORMERS
        if any(name.endswith("n_jobs") for name in e.get_params())
    ],
    ids=name_of,
)
def test_n_jobs_changes_no_bit(estimator):
    X, y = signals((200, 30)), labels(200)
    names = [name for name in estimator.get_params() if name.endswith("n_jobs")]
    one = clone(estimator).set_params(**dict.fromkeys(names, 1)).fit(X, y)
    two = clone(estimator).set_params(**dict.fromkeys(names, 2)).fit(X, y)
    for name, value in vars(one).items():
        if name.endswith("_") and isinstance(value, np.ndarray | float):
            np.testing.assert_array_equal(value, vars(two)[name])
    np.testing.assert_array_equal(one.transform(X), two.transform(X))
