"""Common code of the fetchers: download the files of a rig, verify them, cut them into windows."""

import hashlib
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from scipy.io import loadmat
from sklearn.datasets import fetch_file, get_data_home
from sklearn.utils import Bunch

from skarxlag.recordings.windows import stack_windows


def fetch_rig(
    name: str,
    checksums: dict[str, str],
    base_url: str,
    *,
    sampling_rate: float,
    description: str,
    data_home: str | os.PathLike[str] | None,
    download_if_missing: bool,
    return_X_y: bool,
    window_length: int,
    n_retries: int,
    delay: float,
    verbose: bool,
) -> Bunch | tuple[Any, ...]:
    """Fetch the files of a rig and cut its recordings into windows.

    Parameters
    ----------
    name : str
        Folder of the rig below the data home of scikit-learn.
    checksums : dict of str to str
        SHA-256 in hexadecimal of every file, by its path in the repository.
    base_url : str
        URL of the root of the repository.
    sampling_rate : float
        Sampling rate in Hz.
    description : str
        Description of the rig, which becomes ``DESCR`` of the Bunch.
    data_home, download_if_missing, return_X_y, window_length, n_retries, delay, verbose
        Parameters of the public fetchers, such as `skarxlag.datasets.fetch_uestc`.

    Returns
    -------
    Bunch, or tuple of ndarray
        The rig as a Bunch, or its windows and their conditions if `return_X_y` is True.
    """
    paths = fetch_files(
        checksums,
        _data_home(data_home) / name,
        base_url,
        download_if_missing=download_if_missing,
        n_retries=n_retries,
        delay=delay,
        verbose=verbose,
    )
    rig = load_rig(
        paths, window_length=window_length, sampling_rate=sampling_rate, description=description
    )
    return (rig.data, rig.target) if return_X_y else rig


def fetch_files(
    checksums: dict[str, str],
    folder: Path,
    base_url: str,
    *,
    download_if_missing: bool,
    n_retries: int,
    delay: float,
    verbose: bool,
) -> list[Any]:
    """Download the files of a repository into a folder, and verify every file.

    A file that is already there with the right SHA-256 is not downloaded again.

    Parameters
    ----------
    checksums : dict of str to str
        SHA-256 in hexadecimal of every file, by its path in the repository.
    folder : Path
        Folder for the files, with the same layout as the repository.
    base_url : str
        URL of the root of the repository.
    download_if_missing, n_retries, delay, verbose
        Parameters of the public fetchers, such as `skarxlag.datasets.fetch_uestc`.

    Returns
    -------
    paths : list of Path
        The files, in the order of `checksums`.

    Raises
    ------
    OSError
        If a file is missing or damaged and `download_if_missing` is False, or if a download fails.
    """
    paths = []
    for number, (name, sha256) in enumerate(checksums.items(), start=1):
        path = folder / name
        paths.append(path)
        if _is_intact(path, sha256):
            continue
        if not download_if_missing:
            state = "is not the original (its SHA-256 differs)" if path.exists() else "is missing"
            raise OSError(f"{path} {state} and download_if_missing is False")
        url = f"{base_url.rstrip('/')}/{quote(name)}"
        if verbose:
            print(f"[{number}/{len(checksums)}] downloading {url}", file=sys.stderr, flush=True)
        created = [folder for folder in path.parents if not folder.exists()]
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            fetch_file(
                url,
                folder=path.parent,
                local_filename=path.name,
                sha256=sha256,
                n_retries=n_retries,
                delay=delay,
            )
        except (OSError, HTTPException) as error:
            with suppress(OSError):
                for empty in created:
                    empty.rmdir()
            raise OSError(f"{path} could not be fetched from {url}: {error}") from error
    return paths


def load_rig(
    paths: Sequence[Path], *, window_length: int, sampling_rate: float, description: str
) -> Bunch:
    """Read recordings and cut them into windows, as the Bunch of a rig.

    Every file holds one array and is named ``condition_rpm...mat``. The conditions are listed in
    the order in which they first occur in the paths, so that the healthy condition must come
    first.
    """
    names = [path.stem for path in paths]
    condition = np.array([name.split("_")[0] for name in names])
    rpm = np.array([float(name.split("_")[1]) for name in names])
    data, source, start = stack_windows(
        [_read_signal(path) for path in paths], [str(path) for path in paths], window_length
    )
    return Bunch(
        data=data,
        target=condition[source],
        target_names=list(dict.fromkeys(condition.tolist())),
        rpm=rpm[source],
        recording=np.array(names)[source],
        start=start,
        sampling_rate=float(sampling_rate),
        filenames=[str(path) for path in paths],
        DESCR=description,
    )


def _data_home(data_home):
    # get_data_home is not called with a given folder, because it would create this folder even if
    # no file is stored there in the end.
    return Path(get_data_home() if data_home is None else data_home).expanduser()


def _is_intact(path, sha256):
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == sha256


def _read_signal(path):
    # The name of the signal differs between files. It is the only array: all other values in a
    # file are single numbers or strings.
    (signal,) = (
        values
        for values in loadmat(path).values()
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and values.size > 1
    )
    return signal.ravel()
