import io
import sys

from skarxlag.plant.commands.messages import Reporter


def progress_text(monkeypatch, stream, quiet=False, verbose=False):
    monkeypatch.setattr(sys, "stderr", stream)
    progress = Reporter(quiet, verbose, total=2)
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
