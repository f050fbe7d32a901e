"""Recordings: from files and tables of files to windows."""

from .files import iter_windows, list_channels, read_recording
from .rig import load_recordings, read_recording_table
from .windows import make_windows

__all__ = [
    "iter_windows",
    "list_channels",
    "load_recordings",
    "make_windows",
    "read_recording",
    "read_recording_table",
]
