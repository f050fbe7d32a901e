import importlib
import pickle
import re
import shutil
import sys
import tracemalloc
from pathlib import Path
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZIP_LZMA, ZIP_STORED, ZipFile

import numpy as np
import pandas as pd
import pytest
import sklearn
import skops.io
from scipy.signal import lfilter
from sklearn.calibration import CalibratedClassifierCV
from sklearn.exceptions import NotFittedError
from sklearn.frozen import FrozenEstimator
from sklearn.linear_model import LogisticRegression
from sklearn.naive_bayes import GaussianNB
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PowerTransformer, StandardScaler
from sklearn.svm import LinearSVC

import skarxlag
from skarxlag import (
    ARXLaguerre,
    DiagnosisPipeline,
    ExtendedStatePIObserver,
    LogSpectra,
    PIObserver,
    SpectralDistance,
    ThresholdLadder,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_extended_state_pio,
    make_known_conditions,
)
from skarxlag.persistence.archives import TRUSTED_TYPES, sealed
from skarxlag.persistence.files import read_members
from skarxlag.persistence.models import load_diagnoser, save_diagnoser

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

rng = np.random.default_rng(0)
Y = np.repeat(["good", "worn", "broken"], 10)
X = np.concatenate(
    [lfilter([1.0], [1.0, a], rng.normal(size=(10, 300))) for a in (-0.9, 0.0, 0.9)]
)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "bearing.skops"
    save_diagnoser(make_alpio(healthy="good").fit(X, Y), path, sampling_rate=50e3)
    return path


@pytest.fixture
def saved(original, tmp_path):
    return Path(shutil.copy(original, tmp_path))


def rewrite(path, change, keep_digest=False):
    """Replace members of the archive by what `change` makes of them."""
    with ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
        comment = file.comment
    with ZipFile(path, "w") as file:
        for name, content in members.items():
            file.writestr(name, change(name, content))
        if keep_digest:
            file.comment = comment


def replaced(old, new):
    """A change of the schema."""
    return lambda name, content: content.replace(old, new)


def come_back(folder, model, **facts):
    """The model and its facts after they were saved and loaded."""
    save_diagnoser(model, folder / "d.skops", **facts)
    return load_diagnoser(folder / "d.skops")


def forge(folder, diagnoser, facts=None, **others):
    """A file with a digest that fits, as somebody who knows the format could make it."""
    content = {"format": "skarxlag diagnoser 1", "diagnoser": diagnoser}
    content |= {"facts": facts or {}} | others
    path = folder / "d.skops"
    path.write_bytes(sealed(skops.io.dumps(content)))
    return path


def refuse(path, message):
    """Load a file, which is refused by a message that names it."""
    with pytest.raises(ValueError, match=rf"{re.escape(path.name)}: .*{message}"):
        load_diagnoser(path)


@pytest.mark.parametrize(
    "diagnoser",
    [
        make_alpio(healthy="good"),
        make_extended_state_pio(healthy=np.str_("good")),
        make_alpio().set_params(observe=ExtendedStatePIObserver(n_observers=1)),
        make_diagnoser(healthy="good"),
        make_pipeline(ARXLaguerre(healthy="good", order=(3,), pole=[0.1]), PIObserver(),
                      ThresholdLadder()),
        make_pipeline(ARXLaguerre(pole="optimise", order=4, bank=False), LogSpectra(),
                      SpectralDistance(), ThresholdLadder()),
    ],
)  # fmt: skip
def test_round_trip_predicts_the_same_to_the_last_bit(tmp_path, diagnoser):
    diagnoser = diagnoser.fit(X, Y)
    loaded, _ = come_back(tmp_path, diagnoser)
    np.testing.assert_array_equal(loaded.predict(X), diagnoser.predict(X))
    np.testing.assert_array_equal(loaded.predict_proba(X), diagnoser.predict_proba(X))
    assert str(loaded.get_params()) == str(diagnoser.get_params())


def test_round_trip_of_columns_with_names_and_of_numeric_conditions(tmp_path):
    table = pd.DataFrame(X, columns=[f"sample{k}" for k in range(X.shape[1])])
    detector = make_detector(false_alarm_rate=0.2).fit(table[:10])
    loaded, _ = come_back(tmp_path, detector)
    scores = detector.score_samples(table)
    np.testing.assert_array_equal(loaded.score_samples(table), scores)
    diagnoser = make_alpio(healthy=1).fit(X, np.repeat([1, 2, 3], 10))
    loaded, _ = come_back(tmp_path, diagnoser)
    np.testing.assert_array_equal(loaded.predict(X), diagnoser.predict(X))


def test_facts_come_back(tmp_path):
    facts = {"diagnoser": "alpio", "conditions": ["worn", "good", "broken"]}
    facts |= {"rpm": None, "n": 3, "rate": 0.5}
    versions = {"skarxlag": skarxlag.__version__, "scikit-learn": sklearn.__version__}
    loaded = come_back(tmp_path, make_alpio().fit(X, Y), **facts)
    assert loaded[1] == facts | versions


ODD_FACTS = [
    {"conditions": ["good", "good", "worn"]},
    {"conditions": ["good", "worn", "broken", "cage"]},
    {"conditions": "good"},
    {"train_rpm": 500},
    {"train_rpm": [0.0]},
    {"window_length": 1200},
    {"window_length": True},
    {"n_channels": 2},
    {"sampling_rate": -1.0},
    {"sampling_rate": float("inf")},
    {"false_alarm_rate": 1.5},
    {"n_windows": [1]},
    {"n_recordings": [1, 2, 3, 4]},
    {"channels": ["drive", "fan"]},
    {"channel_names": "drive"},
    {"unit": 9.81},
    {"diagnoser": 3},
    {"healthy": "broken"},
    {"healthy": "good", "conditions": ["worn", "good", "broken"]},
    {"saved": ["2020"]},
    {"note": "\x1b[2Jhealthy"},
    {"\x1b[31m": 1},
]


@pytest.mark.parametrize("facts", ODD_FACTS, ids=str)
def test_facts_that_cannot_be_are_neither_saved_nor_loaded(facts, tmp_path, saved):
    diagnoser, path = make_alpio().fit(X, Y), tmp_path / "d.skops"
    with pytest.raises(ValueError, match=re.escape(next(iter(facts)))):
        save_diagnoser(diagnoser, path, **facts)
    assert not path.exists()
    refuse(forge(tmp_path, diagnoser, facts), "")


def test_conditions_with_terminal_escapes_are_not_saved(tmp_path):
    y = np.where(Y == "worn", "\x1b[2Jworn", Y)
    with pytest.raises(ValueError, match="expected printable characters"):
        save_diagnoser(make_alpio().fit(X, y), tmp_path / "d.skops")


def test_a_detector_names_its_healthy_condition(tmp_path):
    detector = make_detector(false_alarm_rate=0.2).fit(X[:10])
    assert come_back(tmp_path, detector, conditions=["ok"])[1]["conditions"] == ["ok"]
    with pytest.raises(ValueError, match="expected the healthy one only"):
        save_diagnoser(detector, tmp_path / "d.skops", conditions=["ok", "worn"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_detector_and_known_conditions_are_saved_with_the_diagnoser(tmp_path):
    path, diagnoser = tmp_path / "d.skops", make_alpio().fit(X, Y)
    detector = make_detector(false_alarm_rate=0.2).fit(X[:10])
    known = make_known_conditions().fit(X, Y)
    companions = {"known_conditions": known, "detector": detector}
    facts = come_back(tmp_path, diagnoser, **companions)[1]
    for name, model in companions.items():
        np.testing.assert_array_equal(facts[name].p_values(X), model.p_values(X))
        message = rf"{name} is a \w+, expected .* make_{name}"
        with pytest.raises(TypeError, match=message):
            save_diagnoser(diagnoser, path, **{name: LinearSVC().fit(X, Y)})
    # A diagnoser has an alarm, too.
    named = make_alpio(healthy="good").fit(X, Y)
    with pytest.raises(TypeError, match="expected the result of make_detector"):
        save_diagnoser(diagnoser, path, detector=named)


@pytest.mark.parametrize(
    ("step", "name", "value"),
    [
        ("identify", "order", 0),
        ("identify", "alpha", -1.0),
        ("compare", "sampling_rate", -1.0),
        ("decide", "false_alarm_rate", 2.0),
    ],
)
def test_parameter_out_of_its_range_is_refused_at_load(step, name, value, tmp_path):
    diagnoser = make_diagnoser(sampling_rate=10_000).fit(X, Y, rpm=20_000.0)
    part = diagnoser["decide"].residual_.order_residual_
    setattr(part if step == "compare" else diagnoser[step], name, value)
    refuse(forge(tmp_path, diagnoser), name)


def test_trusted_types_are_classes_by_the_names_that_files_hold():
    # A name that scikit-learn does not have may come to mean something else.
    for trusted in TRUSTED_TYPES:
        module, _, name = trusted.rpartition(".")
        member = getattr(importlib.import_module(module), name)
        assert isinstance(member, type)
        assert f"{member.__module__}.{member.__qualname__}" == trusted


@pytest.mark.parametrize(
    ("model", "facts", "error", "message"),
    [
        (
            make_pipeline(PIObserver(), KNeighborsClassifier()),
            {},
            TypeError,
            "KNeighborsClassifier",
        ),
        (ARXLaguerre(), {}, TypeError, "diagnoser is a ARXLaguerre, expected"),
        (
            make_alpio(),
            {"when": [object()]},
            TypeError,
            r"when=\[<object.*holds a object, expected a text",
        ),
    ],
)
def test_what_load_would_refuse_is_not_saved(tmp_path, model, facts, error, message):
    path = tmp_path / "d.skops"
    with pytest.raises(NotFittedError, match="not fitted"):
        save_diagnoser(make_alpio(), path)
    with pytest.raises(error, match=message):
        save_diagnoser(model.fit(X, Y), path, **facts)
    assert not path.exists()


def test_foreign_model_is_refused(tmp_path):
    path = tmp_path / "d.skops"
    skops.io.dump(GaussianNB().fit(X, Y), path)
    # Plain skops would load it.
    skops.io.load(path)
    refuse(path, "it holds a sklearn.*GaussianNB")


@pytest.mark.parametrize(
    ("change", "keep_digest", "message"),
    [
        (replaced(b'"skarxlag.models.observers"', b'"subprocess"'), True,
         r"it holds a subprocess\.PIObserver"),
        (replaced(b'"ObjectNode"', b'"FunctionNode"'), True, "FunctionNode"),
        (replaced(b"0.05", b"0.06"), True, "changed after it was saved"),
        (replaced(b"0.05", b"0.06"), False, "changed after it was saved"),
    ],
    ids=["a foreign step", "another loader", "a number", "a number, no digest"],
)  # fmt: skip
def test_edited_schema_is_refused(saved, change, keep_digest, message):
    rewrite(saved, change, keep_digest)
    refuse(saved, message)


def test_repacking_without_a_change_keeps_the_file_valid(saved):
    rewrite(saved, lambda name, content: content, keep_digest=True)
    load_diagnoser(saved)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
def test_damaged_file_is_refused(saved, share):
    content = bytearray(saved.read_bytes())
    saved.write_bytes(content[: int(share * len(content))])
    refuse(saved, "")
    content[len(content) // 3] ^= 1
    saved.write_bytes(content)
    refuse(saved, "")


def test_pickle_is_refused_unread(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (pytest.fail, ("the pickle was loaded",))

    path = tmp_path / "d.skops"
    path.write_bytes(pickle.dumps(Bomb()))
    refuse(path, ".*not a zip file")


@pytest.mark.parametrize(
    "schema", [b"{}", b"[]", b"nonsense", b'{"__loader__": []}', b"[" * 100_000]
)
def test_schema_that_is_none_is_refused(saved, schema):
    rewrite(saved, lambda name, content: schema if name == "schema.json" else content)
    refuse(saved, "")


@pytest.mark.parametrize("content", [{"format": "another"}, {"diagnoser": 3}, [1, 2]])
def test_archive_of_something_else_is_refused(tmp_path, content):
    path = tmp_path / "d.skops"
    path.write_bytes(sealed(skops.io.dumps(content)))
    refuse(path, "")


def test_missing_file():
    with pytest.raises(FileNotFoundError, match=r"gone\.skops: no such file"):
        load_diagnoser("gone.skops")


@pytest.mark.parametrize(
    ("step", "name", "value"),
    [
        ("identify", "coef_", np.zeros((1, 0))),
        ("identify", "orders_", np.array([10**9])),
        ("measure", "n_models_", 7),
        ("compare", "references_", np.zeros((3, 10**6))),
        ("decide", "isolation_thresholds_", np.zeros(0)),
    ],
)
def test_tampered_model_is_refused_at_load_by_name(tmp_path, step, name, value):
    steps = [
        ("identify", ARXLaguerre(bank=False)),
        ("measure", LogSpectra()),
        ("compare", SpectralDistance()),
        ("decide", ThresholdLadder()),
    ]
    diagnoser = DiagnosisPipeline(steps).fit(X, Y)
    setattr(diagnoser[step], name, value)
    # Of two attributes that contradict each other either may be named.
    names = f"({name}|coef_|isolation_thresholds_)"
    refuse(forge(tmp_path, diagnoser), rf"Step '\w+': .*{names}")


def test_content_of_another_kind_is_refused(tmp_path):
    for facts in ({"n": [{}]}, 3):
        refuse(forge(tmp_path, make_alpio().fit(X, Y), facts), "")
    refuse(forge(tmp_path, None), "")


def test_models_around_our_steps_come_back(tmp_path):
    front = [ARXLaguerre(order=4), PIObserver()]
    models = [
        CalibratedClassifierCV(make_diagnoser(), cv=2),
        CalibratedClassifierCV(FrozenEstimator(make_alpio().fit(X, Y))),
        make_pipeline(*front, StandardScaler(), LogisticRegression()),
        make_pipeline(make_pipeline(*front), PowerTransformer(), LinearSVC()),
    ]
    for model in models:
        loaded, _ = come_back(tmp_path, model.fit(X, Y))
        np.testing.assert_array_equal(loaded.predict(X), model.predict(X))


def test_tampered_model_within_a_calibration_is_refused(tmp_path):
    model = CalibratedClassifierCV(make_alpio(), cv=2).fit(X, Y)
    model.calibrated_classifiers_[1].estimator[0].coef_ = np.zeros((1, 0))
    message = r"Step 'identify': coef_ has shape \(1, 0\)"
    with pytest.raises(ValueError, match=message):
        save_diagnoser(model, tmp_path / "d.skops")
    refuse(forge(tmp_path, model), message)


def test_folder_of_the_cache_is_forgotten(tmp_path):
    cache = str(tmp_path / "cache")
    diagnoser = make_alpio(memory=cache).fit(X, Y)
    assert come_back(tmp_path, diagnoser)[0].memory is None
    assert diagnoser.memory == cache
    assert load_diagnoser(forge(tmp_path, diagnoser))[0].memory is None


def archive(path, members, compression=ZIP_STORED):
    with ZipFile(path, "w", compression) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


@pytest.mark.parametrize("compression", [ZIP_BZIP2, ZIP_LZMA])
def test_compression_that_needs_memory_is_refused(saved, tmp_path, compression):
    members, _ = read_members(saved.read_bytes())
    refuse(archive(tmp_path / "d.skops", members, compression), ".*neither stored nor")


def peak_of(call):
    tracemalloc.start()
    call()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_file_that_unpacks_to_gigabytes_is_refused_before_it_does(tmp_path):
    members = {"schema.json": b" " * 200_000_000}
    path = archive(tmp_path / "d.skops", members, ZIP_DEFLATED)
    assert path.stat().st_size < 1e6
    assert peak_of(lambda: refuse(path, "unpacks to 200,000,000 bytes")) < 1e7


def test_size_that_is_a_lie_unpacks_no_more_than_it_says(tmp_path):
    members = {"schema.json": b" " * 90_000_000}
    path = archive(tmp_path / "d.skops", members, ZIP_DEFLATED)
    content = path.read_bytes()
    path.write_bytes(content.replace((90_000_000).to_bytes(4, "little"), b"\x10\0\0\0"))
    assert peak_of(lambda: refuse(path, "")) < 1e7


def test_long_schema_is_refused_before_it_is_parsed(tmp_path):
    schema = b"[" + b"[]," * 10_000_000 + b"[]]"
    path = archive(tmp_path / "d.skops", {"schema.json": schema}, ZIP_DEFLATED)
    assert peak_of(lambda: refuse(path, "schema.json has 30,000,004 bytes")) < 2e8


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.replace(b"(3, 32)", b"(3, 99)"), r"states 2,376 bytes"),
        (lambda c: c.replace(b"<f8", b"|O8"), "array of object"),
        (lambda c: c.replace(b"\x93NUMPY\x01", b"\x93NUMPY\x07"), r"format \(7, 0\)"),
        (lambda c: b"PK" + c[2:], "magic"),
    ],
)
def test_array_that_states_another_size_than_it_has_is_refused(saved, change, message):
    def of_arrays(name, content):
        return change(content) if b"(3, 32)" in content[:128] else content

    rewrite(saved, of_arrays, keep_digest=True)
    refuse(saved, message)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_two_members_of_one_name_are_refused(saved):
    with ZipFile(saved, "a") as file:
        file.writestr("schema.json", b"{}")
    refuse(saved, "same name")


def test_missing_skops_is_named_with_its_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "skops.io", None)
    with pytest.raises(ImportError, match=r"pip install 'skarxlag\[io\]'"):
        save_diagnoser(make_alpio(), "d")


def test_skops_itself_loads_a_diagnoser_with_the_public_list():
    """So do programs that pass such a list on, MLflow for one."""
    locations = {"worn": "outer", "broken": None}
    with_bearing = make_diagnoser(
        sampling_rate=2_000.0, bearing="6205", locations=locations
    )
    for model in (
        with_bearing.fit(X, Y, rpm=900.0),
        make_detector(false_alarm_rate=0.2).fit(X[:10]),
    ):
        loaded = skops.io.loads(skops.io.dumps(model), trusted=TRUSTED_TYPES)
        np.testing.assert_array_equal(loaded.predict(X), model.predict(X))


def test_memory_that_is_short_is_named(saved, monkeypatch):
    def loads(*arguments, **options):
        raise MemoryError

    monkeypatch.setattr("skops.io.loads", loads)
    with pytest.raises(MemoryError, match=r"bearing\.skops: not enough memory"):
        load_diagnoser(saved)
