"""Recordings in files: one file, the channels asked for, all at once or block after block."""

from numbers import Integral
from pathlib import Path

import numpy as np
import pandas as pd
from pandas.api.types import is_bool_dtype, is_numeric_dtype

from .formats import channel_blocks
from .windows import block_length, cut_blocks


def read_recording(path, *, channel=None):
    """Read one recording, one channel of it or several.

    The channels that a file offers, in their order:

    - ``.mat`` (MATLAB up to v7) and ``.npz``: every numeric array of more than one value, by the
      name of the variable. Single numbers, texts and structs are no channels. The rows or columns
      of a matrix, whichever are longer, are channels ``name[0]``, ``name[1]``, ...
    - ``.npy``: the array is ``0``, or its channels are ``0``, ``1``, ... as above.
    - ``.csv`` (comma, decimal point) and ``.parquet``: the columns. The first line of a csv file
      is data when it holds nothing but numbers, and the columns are then ``0``, ``1``, ...
    - ``.wav``: ``0``, ``1``, ... Integer samples are divided by the full scale of their type, so
      that they lie in [-1, 1); floating-point samples are taken as they are.

    A text file that was cut at the end of a line, or within the last number, cannot be told from
    a whole one; every other damage raises an error.

    Parameters
    ----------
    path : str or path-like
        The file. Its suffix, in any case, tells the format.
    channel : str, int or sequence of these, default=None
        Name of the channel, or its position counted from 0; a text of digits is a position
        unless a channel bears that name. Of a sequence, the first is the output and the others
        are the inputs. None takes the only channel, and is an error when there are several.

    Returns
    -------
    signal : ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        Two-dimensional if `channel` is a sequence.
    sampling_rate : float or None
        In Hz, where the format states it, which only ``.wav`` does.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the format is not known or the file cannot be read (damaged, truncated, pickled,
        MATLAB v7.3), if the channel is unknown or ambiguous, and if its values are not numeric,
        complex, NaN or infinite, or of another length than those of the other channels. The
        message names the file.
    ImportError
        If ``.parquet`` is asked for and no reader of it is installed.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from skarxlag.recordings import read_recording
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "run_1.npz")
    ...     np.savez(path, emission=[0.5, -0.5, 0.25], torque=[4, 5, 6], rate=250000)
    ...     signal, sampling_rate = read_recording(path, channel=["emission", "torque"])
    >>> signal
    array([[ 0.5 , -0.5 ,  0.25],
           [ 4.  ,  5.  ,  6.  ]])
    """
    return next(recording_blocks(path, channel=channel))


def iter_windows(path, window_length=1200, *, channel=None):
    """Cut a recording of any length into windows, without ever holding all of it in memory.

    MATLAB and ``.npz`` files, and ``.wav`` of 24 bit, can only be read whole; windows of all other
    formats are read as they are asked for.

    Parameters
    ----------
    path : str or path-like
        The file, see :func:`read_recording`.
    window_length : int, default=1200
        Samples in a window, at least 1. Windows neither overlap nor leave gaps; the tail of the
        recording that does not fill a window is left out.
    channel : str, int or sequence of these, default=None
        As in :func:`read_recording`.

    Yields
    ------
    ndarray of float64, shape (n_windows, window_length) or (n_windows, n_channels, window_length)
        The next windows in time order, at most about a million samples of each channel.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`, when the samples in question are reached; and if the
        recording is shorter than one window.
    TypeError
        If `window_length` is not an integer.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from skarxlag import iter_windows
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "day.npy")
    ...     np.save(path, np.arange(2_500_000))
    ...     [windows.shape for windows in iter_windows(path, 1000)]
    [(1048, 1000), (1048, 1000), (404, 1000)]
    """
    blocks = recording_blocks(path, block_length(window_length), channel=channel)
    yield from cut_blocks((signal for signal, _ in blocks), str(path), window_length)


def recording_blocks(path, n_samples=None, *, channel=None):
    """Read one recording block after block.

    Parameters
    ----------
    path, channel
        As in :func:`read_recording`.
    n_samples : int or None, default=None
        Samples of a block, at most, where the format can be read in parts. None: one block of all.

    Yields
    ------
    signal : ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The next samples.
    sampling_rate : float or None
        As in :func:`read_recording`.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`, when the block in question is reached.
    """
    path = Path(path)
    start = 0
    for channels, sampling_rate in channel_blocks(path, n_samples):
        signal = _chosen_signal(path, channels, channel, start)
        yield signal, sampling_rate
        start += signal.shape[-1]


def _chosen_signal(path, channels, channel, start):
    if channel is None:
        if len(channels) > 1:
            raise ValueError(
                f"{path}: several channels and none chosen; available: {_listed(channels)}"
            )
        return _check_signal(path, *next(iter(channels.items())), start)
    if isinstance(channel, str | Integral):
        return _check_signal(path, *_choose(path, channels, channel), start)
    chosen = [_choose(path, channels, each) for each in channel]
    if not chosen:
        raise ValueError(f"{path}: channel is an empty sequence; available: {_listed(channels)}")
    signals = [_check_signal(path, *each, start) for each in chosen]
    lengths = {name: len(signal) for (name, _), signal in zip(chosen, signals, strict=True)}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"{path}: channels of different length, in samples: {lengths}")
    return np.stack(signals)


def _choose(path, channels, channel):
    if isinstance(channel, str) and channel in channels:
        return channel, channels[channel]
    names = list(channels)
    is_position = isinstance(channel, Integral) or (
        isinstance(channel, str) and channel.isdecimal()
    )
    if is_position and 0 <= int(channel) < len(names):
        name = names[int(channel)]
        return name, channels[name]
    raise ValueError(f"{path}: no channel {channel!r}; available: {_listed(channels)}")


def _listed(channels):
    names = [repr(name) for name in channels]
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "")


def _check_signal(path, name, values, start):
    where = f"{path}: channel {name!r}"
    if not is_numeric_dtype(values.dtype) or is_bool_dtype(values.dtype):
        raise ValueError(f"{where} is not numeric{_first_text(values, start)}")
    if np.issubdtype(getattr(values.dtype, "numpy_dtype", values.dtype), np.complexfloating):
        raise ValueError(f"{where} is complex; store its real part or its magnitude")
    if isinstance(values, pd.Series):
        values = values.to_numpy(dtype=np.float64, na_value=np.nan)
    signal = np.array(values, dtype=np.float64)
    if signal.size == 0 and start == 0:
        raise ValueError(f"{where} is empty")
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        raise ValueError(
            f"{where} has missing, NaN or infinite values, the first at sample {start + bad[0]}"
        )
    return signal


def _first_text(values, start):
    if not isinstance(values, pd.Series):
        return f" but of type {values.dtype}"
    bad = np.flatnonzero(pd.to_numeric(values, errors="coerce").isna() & values.notna())
    return f": {values.iloc[bad[0]]!r} at sample {start + bad[0]}" if bad.size else ""
