"""Recordings: from files and tables of files to windows."""

from .files import iter_windows, read_recording
from .table import load_recordings, read_recording_table
from .windows import make_windows

__all__ = [
    "iter_windows",
    "load_recordings",
    "make_windows",
    "read_recording",
    "read_recording_table",
]
