import io
import sys
from argparse import Namespace

import pytest

from skarxlag.commands.messages import Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def told(monkeypatch, stream, quiet=False, verbose=False):
    monkeypatch.setattr(sys, "stderr", stream)
    with Progress(2, "recordings", Namespace(quiet=quiet, verbose=verbose)) as progress:
        progress.step("a.npy: good", "9 windows")
        progress.step("b.npy: worn")
    return stream.getvalue()


def test_lines_in_a_log(monkeypatch):
    assert told(monkeypatch, io.StringIO()) == "[1/2] a.npy: good\n[2/2] b.npy: worn\n"
    more = told(monkeypatch, io.StringIO(), verbose=True)
    assert more.startswith("[1/2] a.npy: good (9 windows)\n[2/2] b.npy: worn\n2 recordings in ")


def test_a_bar_on_a_terminal(monkeypatch):
    pytest.importorskip("tqdm")
    bar = told(monkeypatch, Terminal())
    assert "2/2" in bar and "recordings" in bar and "a.npy" not in bar
    more = told(monkeypatch, Terminal(), verbose=True)
    assert "2/2" in more and "[1/2] a.npy: good (9 windows)\n" in more


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_nothing_when_quiet(monkeypatch, stream):
    assert told(monkeypatch, stream(), quiet=True) == ""


def test_lines_on_a_terminal_without_the_library_of_bars(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    assert told(monkeypatch, Terminal()) == "[1/2] a.npy: good\n[2/2] b.npy: worn\n"
