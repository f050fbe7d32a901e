import io
import json
import pickle
import sys
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
import sklearn
import skops.io
from scipy.signal import lfilter
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline

import skarxlag
from skarxlag import (
    ARXLaguerre,
    CepstralResidual,
    FaultDetector,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
    make_single_observer_pio,
)
from skarxlag.persistence import TRUSTED_TYPES, load_diagnoser, save_diagnoser, write_atomically

rng = np.random.default_rng(0)
Y = np.repeat(["good", "worn", "broken"], 10)
X = np.concatenate([lfilter([1.0], [1.0, a], rng.normal(size=(10, 300))) for a in (-0.9, 0.0, 0.9)])


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "bearing.skops"
    save_diagnoser(make_alpio(healthy="good").fit(X, Y), path, sampling_rate=50e3)
    return path


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


@pytest.mark.parametrize(
    "diagnoser",
    [
        make_alpio(healthy="good"),
        make_extended_state_pio(healthy=np.str_("good")),
        make_single_observer_pio(healthy="good"),
        make_diagnoser(healthy="good"),
        make_pipeline(ARXLaguerre(healthy="good", order=(3,), pole=[0.1]), PIObserver(),
                      ThresholdLadder()),
        make_pipeline(ARXLaguerre(pole="optimise", order=4), CepstralResidual(), ThresholdLadder()),
    ],
)  # fmt: skip
def test_round_trip_predicts_the_same_to_the_last_bit(tmp_path, diagnoser):
    diagnoser = diagnoser.fit(X, Y)
    save_diagnoser(diagnoser, tmp_path / "d.skops")
    loaded, _ = load_diagnoser(tmp_path / "d.skops")
    np.testing.assert_array_equal(loaded.predict(X), diagnoser.predict(X))
    np.testing.assert_array_equal(loaded.predict_proba(X), diagnoser.predict_proba(X))
    assert str(loaded.get_params()) == str(diagnoser.get_params())


def test_round_trip_of_a_detector_fitted_on_a_table(tmp_path):
    table = pd.DataFrame(X, columns=[f"sample{k}" for k in range(X.shape[1])])
    detector = make_pipeline(ARXLaguerre(unit_rms=False), PIObserver(), FaultDetector())
    detector.fit(table[:10])
    save_diagnoser(detector, tmp_path / "d.skops")
    loaded, _ = load_diagnoser(tmp_path / "d.skops")
    np.testing.assert_array_equal(loaded.score_samples(table), detector.score_samples(table))


def test_round_trip_of_numeric_conditions(tmp_path):
    diagnoser = make_alpio(healthy=1).fit(X, np.repeat([1, 2, 3], 10))
    save_diagnoser(diagnoser, tmp_path / "d.skops")
    loaded, _ = load_diagnoser(tmp_path / "d.skops")
    np.testing.assert_array_equal(loaded.predict(X), diagnoser.predict(X))


def test_facts_come_back(tmp_path):
    path = tmp_path / "d.skops"
    facts = {"diagnoser": "alpio", "conditions": ["a", "b"], "rpm": None, "n": 3, "rate": 0.5}
    save_diagnoser(make_alpio().fit(X, Y), path, **facts)
    versions = {"skarxlag": skarxlag.__version__, "scikit-learn": sklearn.__version__}
    assert load_diagnoser(path)[1] == facts | versions


def test_all_estimators_of_the_package_are_trusted():
    public = (getattr(skarxlag, name) for name in skarxlag.__all__)
    own = {
        f"{each.__module__}.{each.__name__}"
        for each in public
        if isinstance(each, type) and issubclass(each, BaseEstimator)
    }
    assert own | {"sklearn.pipeline.Pipeline"} == TRUSTED_TYPES["ObjectNode"]


def test_what_load_would_refuse_is_not_saved(tmp_path):
    path = tmp_path / "d.skops"
    with pytest.raises(TypeError, match="LogisticRegression"):
        save_diagnoser(
            make_pipeline(PIObserver(), LogisticRegression()).fit(rng.normal(size=(30, 9)), Y), path
        )
    with pytest.raises(TypeError, match="diagnoser is a ARXLaguerre, expected a Pipeline"):
        save_diagnoser(ARXLaguerre().fit(X), path)
    with pytest.raises(NotFittedError):
        save_diagnoser(make_alpio(), path)
    with pytest.raises(TypeError, match=r"when=\[<object.*holds a object, expected a text"):
        save_diagnoser(make_alpio().fit(X, Y), path, when=[object()])
    assert not list(tmp_path.iterdir())


def test_foreign_model_is_refused(tmp_path):
    path = tmp_path / "d.skops"
    skops.io.dump(LogisticRegression().fit(X, Y), path)
    # Plain skops would load it.
    skops.io.load(path)
    with pytest.raises(ValueError, match=r"d\.skops: refused, it holds a sklearn.*Logistic"):
        load_diagnoser(path)


def test_foreign_step_is_refused_whatever_the_digest(saved):
    def change(name, content):
        return content.replace(b'"PIObserver"', b'"Popen"').replace(
            b'"skarxlag.observers"', b'"subprocess"'
        )

    rewrite(saved, change, keep_digest=True)
    with pytest.raises(ValueError, match=r"bearing\.skops: refused, it holds a subprocess\.Popen"):
        load_diagnoser(saved)


def test_trusted_type_behind_another_loader_is_refused(saved):
    def change(name, content):
        return content.replace(b'"ObjectNode"', b'"FunctionNode"')

    rewrite(saved, change, keep_digest=True)
    with pytest.raises(ValueError, match="FunctionNode"):
        load_diagnoser(saved)


@pytest.mark.parametrize("keep_digest", [True, False])
def test_edited_numbers_are_refused(saved, keep_digest):
    def change(name, content):
        return content.replace(b"0.05", b"0.06") if name == "schema.json" else content

    rewrite(saved, change, keep_digest)
    with pytest.raises(ValueError, match=r"bearing\.skops: refused, .* changed afterwards"):
        load_diagnoser(saved)


def test_repacking_without_a_change_keeps_the_file_valid(saved):
    rewrite(saved, lambda name, content: content, keep_digest=True)
    load_diagnoser(saved)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_truncated_file_is_refused(saved, share):
    content = saved.read_bytes()
    saved.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ValueError, match=r"bearing\.skops: no diagnoser saved by skarxlag"):
        load_diagnoser(saved)


def test_flipped_bit_is_refused(saved):
    content = bytearray(saved.read_bytes())
    content[len(content) // 3] ^= 1
    saved.write_bytes(content)
    with pytest.raises(ValueError, match=r"bearing\.skops: "):
        load_diagnoser(saved)


def test_pickle_is_refused_unread(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (pytest.fail, ("the pickle was loaded",))

    path = tmp_path / "d.skops"
    path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(ValueError, match="not a zip file"):
        load_diagnoser(path)


@pytest.mark.parametrize(
    "schema", [b"{}", b"[]", b"nonsense", b'{"__loader__": []}', b"[" * 100_000]
)
def test_schema_that_is_none_is_refused(saved, schema):
    rewrite(saved, lambda name, content: schema if name == "schema.json" else content)
    with pytest.raises(ValueError, match=r"bearing\.skops: "):
        load_diagnoser(saved)


@pytest.mark.parametrize("content", [{"format": "another"}, {"diagnoser": 3}, [1, 2]])
def test_archive_of_something_else_is_refused(tmp_path, saved, content):
    # With a digest that fits, as somebody who knows the format could make it.
    archive = io.BytesIO(skops.io.dumps(content))
    path = tmp_path / "d.skops"
    with ZipFile(archive, "a") as file:
        from skarxlag.persistence import _digest

        file.comment = _digest(file)
    path.write_bytes(archive.getvalue())
    with pytest.raises(ValueError, match=r"d\.skops: no diagnoser saved by skarxlag"):
        load_diagnoser(path)


def test_missing_file():
    with pytest.raises(FileNotFoundError, match=r"gone\.skops: no such file"):
        load_diagnoser("gone.skops")


def test_missing_skops_tells_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "skops.io", None)
    for call in (lambda: load_diagnoser(tmp_path), lambda: save_diagnoser(make_alpio(), "d")):
        with pytest.raises(ImportError, match=r"pip install 'skarxlag\[io\]'"):
            call()


def test_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_atomically(path, b"old")

    def fail(source, target):
        assert path.read_bytes() == b"old"
        raise OSError("disk full")

    monkeypatch.setattr("skarxlag._files.os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old" and [path] == list(tmp_path.iterdir())


def test_schema_is_readable_json(saved):
    with ZipFile(saved) as file:
        assert json.loads(file.read("schema.json"))["__class__"] == "dict"
