"""The first screen of README runs as it stands."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from skarxlag import datasets

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")
BLOCK = re.search(r"```python\n(.*?)```", README, flags=re.S)[1]


@pytest.mark.slow
def test_the_first_block_of_python(capsys, monkeypatch):
    # A fifth of the windows.
    shorter = partial(datasets.simulate_rig, n_samples=24_000)
    monkeypatch.setattr(datasets, "simulate_rig", shorter)
    names = {}
    exec(BLOCK, names)
    assert len(BLOCK.splitlines()) <= 20
    shares = dict(re.findall(r"(\w+) (0\.\d+)", capsys.readouterr().out))
    alpio, proposal = float(shares["ALPIO"]), float(shares["proposal"])
    # The windows are simulated with a seed, so these numbers do not vary by chance.
    assert alpio > 0.74 and proposal > 0.853
    true = names["y"][names["rpm"] == 300]
    assert np.mean(true == names["predicted"]) > 0.676


def test_two_command_lines_set_everything_up():
    lines = re.findall(r"^    (\S.*)$", README.partition("```python")[0], flags=re.M)
    assert len(lines) == 2
    assert lines[0].endswith("skarxlag evaluate") and lines[1] == "sh test.sh"
