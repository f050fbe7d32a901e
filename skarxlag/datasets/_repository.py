"""Common code of the fetchers: download the recordings of a rig, verify them, cut them."""

import hashlib
import os
import sys
from collections.abc import Callable
from http.client import HTTPException
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from sklearn.datasets import fetch_file, get_data_home

from skarxlag.bearings import BearingGeometry
from skarxlag.plant.readers.cutting import cut_recordings
from skarxlag.plant.readers.files import list_channels, read_recording
from skarxlag.plant.readers.listing import ListedRecording
from skarxlag.plant.readers.windows import block_length

#: The array of samples in the converted files that a data home may hold.
CONVERTED = "acceleration"
#: Times that a failed download is repeated, with a second between two attempts.
N_RETRIES = 3


class Recording(NamedTuple):
    """One recording: its file in the repository, its labels, a converted file, channel and load."""

    path: str
    condition: str
    rpm: float
    name: str
    sha256: str | None
    converted: str | None = None
    channel: str | None = None
    load: str | None = None


class Source(NamedTuple):
    """Source of a rig.

    ``folder`` is that in the data home, and the name of the description if no other is
    given. ``recordings`` begin with the healthy condition. ``channel`` is read from
    files that do not hold the channel of their recording. ``n_samples`` is the length
    of original files, if it is checked.
    """

    folder: str
    url: str
    sampling_rate: float
    recordings: list[Recording]
    bearing: BearingGeometry | None = None
    description: str | None = None
    channel: str | None = None
    n_samples: int | None = None


def shares_sections(fetch: Callable[..., Any]) -> Callable[..., Any]:
    """Insert the sections that all fetchers share at ``{shared}`` of a docstring."""
    # Docstrings are None if Python runs without them.
    text = str(fetch_rig.__doc__).partition("The source of the rig.\n")[2]
    fetch.__doc__ = str(fetch.__doc__).replace("    {shared}\n", text)
    return fetch


def checksums(rig: str) -> dict[str, str]:
    """Read the SHA-256 of every file of a rig, by its path in the repository.

    The lists have the format of the program ``sha256sum``.
    """
    lines = _text(f"checksums/{rig}.sha256").splitlines()
    return {path: sha256 for sha256, path in (line.split("  ", 1) for line in lines)}


def named_recordings(rig: str, folder: str = "") -> list[Recording]:
    """List the files of a rig below a folder, whose names are condition, speed and maybe a part."""
    recordings = []
    for path, sha256 in checksums(rig).items():
        if path.startswith(folder):
            name = Path(path).stem
            condition, rpm, *_ = name.split("_")
            recordings.append(Recording(path, condition, float(rpm), name, sha256))
    return recordings


def description(name: str) -> str:
    """Read the description of a rig: its terms of use and the work to cite."""
    return _text(f"descr/{name}.rst")


def fetch_rig(
    source: Source,
    *,
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
) -> Any:
    """Fetch the recordings of a rig and cut them into windows.

    A line on standard error reports every download. A failed download is repeated three
    times.

    Parameters
    ----------
    source : Source
        The source of the rig.
    data_home : str or path-like, default=None
        Folder that holds the data sets of scikit-learn. If None, the folder that
        :func:`sklearn.datasets.get_data_home` returns is used. The recordings are
        stored in a subfolder with the name of the rig, with the same layout as in their
        repository. A file that is already there with the right SHA-256 is not
        downloaded again. A file with another SHA-256 is replaced, with a warning.
    download_if_missing : bool, default=True
        If False, raise an OSError instead of downloading.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window. Windows do not overlap. Samples at the end of a recording
        that do not fill a window are not used.
    mirror : str, default=None
        URL of a copy of the repository's root, from which to download. If None, the
        files are downloaded from the repository itself.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings, with the following attributes.

        data : ndarray of float64, shape (n_windows, window_length)
            Acceleration. Windows of one recording are consecutive and in time order.
        target : ndarray of str, shape (n_windows,)
            Condition of each window.
        target_names : list of str
            The conditions, the healthy one first if there is one.
        specimen : ndarray of str, shape (n_windows,)
            Bearing of each window. Each condition was recorded with one bearing, so it
            is the condition.
        load : ndarray of float, shape (n_windows,)
            Load of the machine. NaN if the authors do not state it.
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            In Hz.
        bearing : BearingGeometry or None
            None if the authors do not state the dimensions.
        filenames : list of str
            Path of every recording, in the order of the recordings in `data`.
        DESCR : str
            Description of the rig, its terms of use and the work to cite.
    (data, target) : tuple of ndarray
        The windows and their conditions, if `return_X_y` is True.

    Raises
    ------
    OSError
        If a file is missing or is not the original and `download_if_missing` is False,
        or if it cannot be downloaded. The message names the file.
    ValueError
        If there is no such part of the rig, if `window_length` is below 1 or longer
        than a recording, or if a file cannot be read.
    """
    block_length(window_length)  # Checks it before a file is downloaded.
    # A given folder is not created if no file is stored there in the end.
    home = Path(get_data_home() if data_home is None else data_home).expanduser()
    listed = []
    for recording in source.recordings:
        path = home / (recording.converted or "")
        channel = CONVERTED
        if not path.is_file():
            path = home / source.folder / recording.path
            _provide(recording, path, source, mirror, download_if_missing)
            channel = _original_channel(recording, path, source)
        listed.append(
            ListedRecording(
                None,
                recording.name,
                path,
                channel,
                source.sampling_rate,
                condition=recording.condition,
                rpm=float(recording.rpm),
                load=recording.load,
            )
        )
    rig = cut_recordings(listed, source.folder, window_length)
    rig.bearing = source.bearing
    rig.DESCR = description(source.description or source.folder)
    return (rig.data, rig.target) if return_X_y else rig


def _provide(recording, path, source, mirror, download_if_missing):
    """Download an original file, or check that it is there."""
    if download_if_missing:
        url = f"{(mirror or source.url).rstrip('/')}/{quote(recording.path)}"
        _download(url, path, recording.sha256)
        return
    refusal = "and download_if_missing is False"
    if not path.is_file():
        raise OSError(f"{path} is missing {refusal}")
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    if recording.sha256 not in (None, sha256):
        raise OSError(f"{path} is not the original (another SHA-256) {refusal}")


def _original_channel(recording, path, source):
    """Return the channel to read of an original file, whose length is checked."""
    is_held = recording.channel in set(list_channels(path)["channel"])
    channel = recording.channel if is_held else source.channel
    if source.n_samples is not None:
        n_samples = len(read_recording(path, channel=channel)[0])
        if n_samples != source.n_samples:
            original = f"the original has {source.n_samples}"
            raise OSError(f"{path} has {n_samples} samples, but {original}.")
    return channel


def _text(path):
    return files("skarxlag.datasets").joinpath(path).read_text("utf-8")


def _download(url, path, sha256):
    if not path.exists():
        print(f"downloading {url}", file=sys.stderr, flush=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        fetch_file(
            url,
            folder=path.parent,
            local_filename=path.name,
            sha256=sha256,
            n_retries=N_RETRIES,
        )
    except (OSError, HTTPException) as error:
        raise OSError(f"{path} could not be fetched from {url}: {error}") from error
