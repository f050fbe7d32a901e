"""What the fetchers of real rigs share: files of a repository, verified, cut into windows."""

import hashlib
import sys
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
    data_home: Any,
    download_if_missing: Any,
    return_X_y: Any,
    window_length: Any,
    n_retries: Any,
    delay: Any,
    verbose: Any,
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
        In Hz.
    description : str
        What the Bunch says of the rig.
    data_home, download_if_missing, return_X_y, window_length, n_retries, delay, verbose
        As in the public fetchers.

    Returns
    -------
    Bunch, or tuple of ndarray
        The rig, or its windows and their conditions.
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
    download_if_missing: Any,
    n_retries: Any,
    delay: Any,
    verbose: Any,
) -> list[Any]:
    """Bring the files of a repository into a folder and verify every one.

    Parameters
    ----------
    checksums : dict of str to str
        SHA-256 in hexadecimal of every file, by its path in the repository.
    folder : Path
        Where the files are kept, laid out as in the repository.
    base_url : str
        URL of the root of the repository.
    download_if_missing, n_retries, delay, verbose
        As in the public fetchers.

    Returns
    -------
    paths : list of Path
        The files, in the order of `checksums`.

    Raises
    ------
    OSError
        If a file is missing or damaged and is not to be downloaded, or if its download fails.
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


def load_rig(paths: Any, *, window_length: Any, sampling_rate: Any, description: Any) -> Any:
    """Cut recordings named ``condition_rpm...mat``, one array in each, into a rig's Bunch.

    The conditions stand in the order in which the paths bring them up, the healthy one first.
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
    # With a folder given, get_data_home would create it before anything is known to go there.
    return Path(get_data_home() if data_home is None else data_home).expanduser()


def _is_intact(path, sha256):
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == sha256


def _read_signal(path):
    # The signal goes by another name in every file; beside it there are only single numbers
    # and texts.
    (signal,) = (
        values
        for values in loadmat(path).values()
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and values.size > 1
    )
    return signal.ravel()
