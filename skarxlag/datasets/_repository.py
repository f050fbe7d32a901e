"""Common code of the fetchers: download the recordings of a rig, verify them, cut them."""

import hashlib
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from http.client import HTTPException
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote
from zipfile import BadZipFile

import numpy as np
from scipy.io import loadmat
from sklearn.datasets import fetch_file, get_data_home
from sklearn.utils import Bunch

from skarxlag.bearings import BearingGeometry
from skarxlag.recordings.windows import stack_windows

#: The array of samples in the converted files that a data home may hold.
CONVERTED = "acceleration"


class Repository(NamedTuple):
    """Source of a rig: folder in the data home, URL, rate in Hz, description, bearing."""

    folder: str
    url: str
    sampling_rate: float
    description: str
    bearing: BearingGeometry | None = None


class Recording(NamedTuple):
    """One recording: its file in the repository, its labels, and a converted file to accept."""

    path: str
    condition: str
    rpm: float
    sha256: str | None
    name: str
    converted: str | None = None


@dataclass(frozen=True)
class Download:
    """Where the files of a rig come from and where they are stored.

    Parameters
    ----------
    data_home : str or path-like, default=None
        Folder that holds the data sets of scikit-learn. If None, the folder that
        :func:`sklearn.datasets.get_data_home` returns is used. The recordings are stored in a
        subfolder with the name of the rig, with the same layout as in their repository. A file
        that is already there with the right SHA-256 is not downloaded again. A file with another
        SHA-256 is replaced, with a warning.
    download_if_missing : bool, default=True
        If False, raise an OSError instead of downloading.
    mirror : str, default=None
        URL of a copy of the repository's root, from which to download. If None, the files are
        downloaded from the repository itself.
    n_retries : int, default=3
        Number of times that a failed download is repeated, for each file.
    delay : float, default=1.0
        Time between two attempts, in seconds.
    verbose : bool, default=True
        If True, write one line to standard error for every file that is downloaded.
    """

    data_home: str | os.PathLike[str] | None
    download_if_missing: bool
    mirror: str | None
    n_retries: int
    delay: float
    verbose: bool

    @property
    def home(self) -> Path:
        """Folder of all rigs."""
        # get_data_home is not called with a given folder, because it would create this folder even
        # if no file is stored there in the end.
        home = get_data_home() if self.data_home is None else self.data_home
        return Path(home).expanduser()


def shared_parameters(fetcher: Callable[..., Any]) -> Callable[..., Any]:
    """Insert the parameters of `Download` into the docstring of a fetcher, at ``{download}``."""
    if fetcher.__doc__ and Download.__doc__:
        shared = Download.__doc__.partition("----------\n")[2].strip()
        fetcher.__doc__ = fetcher.__doc__.replace("{download}", shared)
    return fetcher


def checksums(rig: str) -> dict[str, str]:
    """Read the SHA-256 of every file of a rig, by its path in the repository.

    The lists have the format of the program ``sha256sum``.
    """
    lines = _text(f"checksums/{rig}.sha256").splitlines()
    return {path: sha256 for sha256, path in (line.split("  ", 1) for line in lines)}


def fetch_rig(
    repository: Repository,
    recordings: Sequence[Recording],
    read_signal: Callable[[Path], Any],
    download: Download,
    windows: tuple[int, bool],
) -> Bunch | tuple[Any, ...]:
    """Fetch the recordings of a rig and cut them into windows.

    Parameters
    ----------
    repository : Repository
        The source of the rig.
    recordings : sequence of Recording
        The recordings. The healthy condition comes first.
    read_signal : callable
        Function that returns the samples in an original file.
    download : Download
        Options of the download.
    windows : tuple of int and bool
        Samples in a window; whether to return only the windows and their conditions.

    Returns
    -------
    Bunch, or tuple of ndarray
        The rig as a Bunch, or its windows and their conditions.

    Raises
    ------
    OSError
        If a file is missing or damaged and ``download_if_missing`` is False, or if a download
        fails.
    """
    paths, signals = [], []
    for number, recording in enumerate(recordings, start=1):
        converted = download.home / (recording.converted or "")
        if converted.is_file():
            paths.append(converted)
            signals.append(_read_converted(converted))
            continue
        path = download.home / repository.folder / recording.path
        counter = f"[{number}/{len(recordings)}]"
        _fetch(path, download.mirror or repository.url, recording, download, counter)
        paths.append(path)
        signals.append(np.ravel(read_signal(path)))
    window_length, return_X_y = windows
    names = [str(path) for path in paths]
    data, source, start = stack_windows(signals, names, window_length)
    conditions = [recording.condition for recording in recordings]
    target = np.array(conditions)[source]
    if return_X_y:
        return data, target
    return Bunch(
        data=data,
        target=target,
        target_names=list(dict.fromkeys(conditions)),
        rpm=np.array([recording.rpm for recording in recordings], dtype=float)[source],
        recording=np.array([recording.name for recording in recordings])[source],
        start=start,
        sampling_rate=repository.sampling_rate,
        bearing=repository.bearing,
        filenames=names,
        DESCR=_text(f"descr/{repository.description}.rst"),
    )


def _text(path):
    return files("skarxlag.datasets").joinpath(path).read_text("utf-8")


def _read_converted(path):
    try:
        with np.load(path, allow_pickle=False) as content:
            return content[CONVERTED].astype(float).ravel()
    except (KeyError, ValueError, BadZipFile) as error:
        raise OSError(f"{path} must be an npz file with an array {CONVERTED!r}: {error}") from error


def _fetch(path, base_url, recording, download, counter):
    if _is_intact(path, recording.sha256):
        return
    if not download.download_if_missing:
        state = "is not the original (its SHA-256 differs)" if path.exists() else "is missing"
        raise OSError(f"{path} {state} and download_if_missing is False")
    url = f"{base_url.rstrip('/')}/{quote(recording.path)}"
    if download.verbose:
        print(f"{counter} downloading {url}", file=sys.stderr, flush=True)
    created = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        fetch_file(
            url,
            folder=path.parent,
            local_filename=path.name,
            sha256=recording.sha256,
            n_retries=download.n_retries,
            delay=download.delay,
        )
    except (OSError, HTTPException) as error:
        with suppress(OSError):
            for empty in created:
                empty.rmdir()
        raise OSError(f"{path} could not be fetched from {url}: {error}") from error


def _is_intact(path, sha256):
    if not path.is_file() or sha256 is None:
        return path.is_file()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == sha256


def read_only_signal(path: Path) -> Any:
    """Read the only array of numbers in a MATLAB file.

    Its name differs between files. All other values are single numbers or strings.
    """
    (signal,) = (
        values
        for values in loadmat(path).values()
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and values.size > 1
    )
    return signal
