"""Common code of the fetchers: download the recordings of a rig, verify them, cut them."""

import functools
import hashlib
import inspect
import os
import sys
from collections.abc import Callable
from http.client import HTTPException
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote
from zipfile import BadZipFile

import numpy as np
import pandas as pd
from sklearn.datasets import fetch_file, get_data_home
from sklearn.utils import Bunch

from skarxlag.bearings import BearingGeometry
from skarxlag.recordings.files import read_recording
from skarxlag.recordings.windows import block_length, cut_blocks

#: The array of samples in the converted files that a data home may hold.
CONVERTED = "acceleration"
#: Times that a failed download is repeated, with a second between two attempts.
N_RETRIES = 3


class Recording(NamedTuple):
    """One recording: its file in the repository, its labels, and a converted file to accept."""

    path: str
    condition: str
    rpm: float
    name: str
    sha256: str | None
    converted: str | None = None


def _read_only_channel(path):
    return read_recording(path)[0]


class Source(NamedTuple):
    """Source of a rig.

    ``folder`` is that in the data home, and the name of the description if no other is given.
    ``recordings`` begin with the healthy condition. ``read_signal`` takes the path of an original
    file and returns its samples; by default, those of its only channel.
    """

    folder: str
    url: str
    sampling_rate: float
    recordings: list[Recording]
    bearing: BearingGeometry | None = None
    description: str | None = None
    read_signal: Callable[[Path], Any] = _read_only_channel


def fetcher(source_of: Callable[..., Source]) -> Callable[..., Any]:
    """Make the public fetcher of a rig from a function that returns its source.

    The fetcher has the parameters of both functions. The sections that all fetchers share stand at
    ``{shared}`` of its docstring.
    """

    @functools.wraps(source_of)
    def fetch(**options: Any) -> Any:
        own = {name: options.pop(name) for name in parts.parameters if name in options}
        return fetch_rig(source_of(**own), **options)

    parts, shared = inspect.signature(source_of), inspect.signature(fetch_rig)
    options = [each for name, each in shared.parameters.items() if name != "source"]
    fetch.__signature__ = shared.replace(parameters=[*parts.parameters.values(), *options])
    if fetch.__doc__ and fetch_rig.__doc__:
        text = fetch_rig.__doc__
        text = text[text.index("    data_home : ") :]
        fetch.__doc__ = fetch.__doc__.replace("    {shared}\n", text)
    return fetch


def checksums(rig: str) -> dict[str, str]:
    """Read the SHA-256 of every file of a rig, by its path in the repository.

    The lists have the format of the program ``sha256sum``.
    """
    lines = _text(f"checksums/{rig}.sha256").splitlines()
    return {path: sha256 for sha256, path in (line.split("  ", 1) for line in lines)}


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

    A line on standard error reports every download. A failed download is repeated three times.

    Parameters
    ----------
    source : Source
        The source of the rig.
    data_home : str or path-like, default=None
        Folder that holds the data sets of scikit-learn. If None, the folder that
        :func:`sklearn.datasets.get_data_home` returns is used. The recordings are stored in a
        subfolder with the name of the rig, with the same layout as in their repository. A file
        that is already there with the right SHA-256 is not downloaded again. A file with another
        SHA-256 is replaced, with a warning.
    download_if_missing : bool, default=True
        If False, raise an OSError instead of downloading.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window. Windows do not overlap. Samples at the end of a recording that do not
        fill a window are not used.
    mirror : str, default=None
        URL of a copy of the repository's root, from which to download. If None, the files are
        downloaded from the repository itself.

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
        If a file is missing or is not the original and `download_if_missing` is False, or if it
        cannot be downloaded. The message names the file.
    ValueError
        If there is no such part of the rig, or if `window_length` is below 1 or longer than a
        recording.
    """
    block_length(window_length)  # Checks it before a file is downloaded.
    # A given folder is not created if no file is stored there in the end.
    home = Path(get_data_home() if data_home is None else data_home).expanduser()
    names, windows = [], []
    for recording in source.recordings:
        path = home / (recording.converted or "")
        if path.is_file():
            signal = _read_converted(path)
        else:
            path = home / source.folder / recording.path
            if download_if_missing:
                url = f"{(mirror or source.url).rstrip('/')}/{quote(recording.path)}"
                _download(url, path, recording.sha256)
            elif not _is_intact(path, recording.sha256):
                state = "is not the original (another SHA-256)" if path.exists() else "is missing"
                raise OSError(f"{path} {state} and download_if_missing is False")
            signal = np.ravel(source.read_signal(path))
        names.append(str(path))
        windows.append(np.concatenate([*cut_blocks([signal], str(path), window_length)]))
    counts = [len(each) for each in windows]
    row = np.repeat(np.arange(len(counts)), counts)
    recordings = pd.DataFrame(source.recordings)
    rig = Bunch(
        data=np.concatenate(windows),
        target=recordings["condition"].to_numpy(dtype=str)[row],
        target_names=recordings["condition"].unique().tolist(),
        rpm=recordings["rpm"].to_numpy(dtype=float)[row],
        recording=recordings["name"].to_numpy(dtype=str)[row],
        start=np.concatenate([np.arange(count) * window_length for count in counts]),
        sampling_rate=source.sampling_rate,
        bearing=source.bearing,
        filenames=names,
        DESCR=description(source.description or source.folder),
    )
    return (rig.data, rig.target) if return_X_y else rig


def _text(path):
    return files("skarxlag.datasets").joinpath(path).read_text("utf-8")


def _read_converted(path):
    try:
        with np.load(path, allow_pickle=False) as content:
            return content[CONVERTED].astype(float).ravel()
    except (KeyError, ValueError, BadZipFile) as error:
        raise OSError(f"{path} must be an npz file with an array {CONVERTED!r}: {error}") from error


def _download(url, path, sha256):
    if not path.exists():
        print(f"downloading {url}", file=sys.stderr, flush=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        fetch_file(
            url, folder=path.parent, local_filename=path.name, sha256=sha256, n_retries=N_RETRIES
        )
    except (OSError, HTTPException) as error:
        raise OSError(f"{path} could not be fetched from {url}: {error}") from error


def _is_intact(path, sha256):
    if not path.is_file() or sha256 is None:
        return path.is_file()
    return hashlib.sha256(path.read_bytes()).hexdigest() == sha256
