import io
import sys
from argparse import Namespace

import pytest

from skarxlag.plant.commands.messages import Progress
from skarxlag.plant.commands.progress_bar import ProgressBar


def progress_text(monkeypatch, stream, quiet=False, verbose=False):
    monkeypatch.setattr(sys, "stderr", stream)
    progress = Progress(2, Namespace(quiet=quiet, verbose=verbose))
    progress.step("a.npy: good", "9 windows")
    progress.step("b.npy: worn")
    return stream.getvalue()


def test_lines_in_a_log(monkeypatch):
    assert (
        progress_text(monkeypatch, io.StringIO())
        == "[1/2] a.npy: good\n[2/2] b.npy: worn\n"
    )
    more = progress_text(monkeypatch, io.StringIO(), verbose=True)
    assert more == "[1/2] a.npy: good (9 windows)\n[2/2] b.npy: worn\n"


def test_nothing_when_quiet(monkeypatch):
    assert progress_text(monkeypatch, io.StringIO(), quiet=True) == ""


class Terminal(io.StringIO):
    def isatty(self):
        return True


def bar_on(monkeypatch, stream, quiet=False):
    """A bar and its clock, a list of which the last entry is the time."""
    clock = [0.0]
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(
        "skarxlag.plant.commands.progress_bar.time.monotonic", lambda: clock[-1]
    )
    return ProgressBar({"fast": 10, "slow": 4}, Namespace(quiet=quiet)), clock


def test_a_bar_estimates_by_the_kind_of_work(monkeypatch):
    stream = Terminal()
    bar, clock = bar_on(monkeypatch, stream)
    clock.append(5.0)
    bar.advance("fast", 5)
    # Half of the fast work took 5 s. As long as it is not known, slow work counts
    # alike.
    assert bar.seconds_left() == 9
    clock.append(15.0)
    bar.advance("slow", 1)
    assert bar.seconds_left() == 5 + 30
    assert stream.getvalue().endswith(
        "\r[#########                     ] about 35 s left"
    )
    bar.clear()
    assert stream.getvalue().endswith(" \r")
    clock.append(50.0)
    bar.advance("slow", 3)
    bar.advance("fast", 5)
    assert bar.seconds_left() == 0 and stream.getvalue().endswith(" \r")


@pytest.mark.parametrize(
    ("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)]
)
def test_no_bar_in_a_log_or_when_quiet(monkeypatch, stream, quiet):
    bar, clock = bar_on(monkeypatch, stream, quiet)
    clock.append(1.0)
    bar.advance("fast", 1)
    bar.clear()
    assert stream.getvalue() == ""
