"""Damaged models predict, or are refused by an error that names them."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skarxlag import load_diagnoser, make_alpio, make_diagnoser, save_diagnoser
from skarxlag.persistence.archives import digest
from skarxlag.persistence.files import read_members
from tests.damage import damaged, some_examples

X = np.random.default_rng(0).normal(size=(12, 80))
Y = np.repeat(["good", "worn"], 6)


@pytest.fixture(scope="module", params=[make_alpio, make_diagnoser])
def members(request, tmp_path_factory):
    """Members of a model file by name."""
    path = tmp_path_factory.mktemp("models") / "model.skops"
    save_diagnoser(request.param().fit(X, Y), path, sampling_rate=1e3)
    return read_members(path.read_bytes())[0]


@pytest.mark.filterwarnings("ignore")
@some_examples
@given(data=st.data())
def test_a_forged_model_predicts_or_is_refused_by_name(tmp_path, members, data):
    """An attacker changes a member, and states a digest that fits."""
    name = data.draw(st.sampled_from(sorted(members)))
    changed = members | {name: data.draw(damaged(members[name]))}
    path = tmp_path / "forged.skops"
    with ZipFile(path, "w") as file:
        for member, content in changed.items():
            file.writestr(member, content)
        file.comment = digest(changed)
    try:
        diagnoser, _ = load_diagnoser(path)
    except (ValueError, OSError) as error:
        assert path.name in str(error)
        return
    if diagnoser[0].window_shape_.tolist() == [80]:
        assert len(diagnoser.predict(X)) == len(X)


@pytest.mark.parametrize(
    "path", sorted(Path(__file__).with_name("damaged").iterdir()), ids=lambda p: p.stem
)
def test_an_inconsistent_model_is_refused(path):
    with pytest.raises(ValueError, match=path.name):
        load_diagnoser(path)
