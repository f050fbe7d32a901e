"""Read recordings from files, whole or block by block."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from .file_facts import Channels, FileFacts, answer, facts_and_samples
from .formats import find_format, read_file
from .formats.isolation import isolated
from .speeds import SpeedProfile

if TYPE_CHECKING:
    import pandas as pd

StrPath = str | os.PathLike[str]


def read_recording(
    path: StrPath, *, channel: Channels = None, dtype: str | None = None
) -> tuple[NDArray[Any], float | None]:
    """Read one or several channels of a recording.

    The end of the file's name, in any case, determines its format. The page
    "Recordings" of the documentation lists the formats, the libraries that they need
    and the facts that they state. The channels of a file, in their order:

    - MATLAB and ``.npz`` files: every numeric array of more than one value, by the name
      of the variable. A field of a struct is ``struct.field``. Single numbers, texts
      and flags are not channels. The rows or columns of a matrix, whichever are longer,
      are ``name[0]``, ``name[1]``, ... HDF5 files: the same, by the path of the data
      set.
    - ``.npy``: the array is ``0``, or its channels are ``0``, ``1``, ... as above.
    - Text, Parquet and Feather: the columns. Separator, decimal sign and header of a
      text file are inferred from its first lines. Lines above the header are skipped.
      Without a header, the columns are ``0``, ``1``, ... A line without any number
      below the header holds the units.
    - Sound: ``0``, ``1``, ... Integer samples are divided by the full scale of their
      type, so that they lie in [-1, 1); floating-point samples are not changed.
    - TDMS: the names of the channels. Universal files: the descriptions of the
      functions, or ``0``, ``1``, ... if descriptions repeat. Vallen tradb: the numbers
      of the channels.

    The file states its sampling rate in its format, in a single number named ``fs``,
    ``SampleRate``, ``dt`` or alike, or by a channel of times named ``time``, ``t`` or
    alike, whose steps must be even. A text such as ``fs_unit`` may state the unit of
    the number. Times may be numbers, dates in ISO 8601, or dates with the day first;
    the sample of a missing time follows the one before.

    A text file that was cut at the end of a line, or within the last number, looks like
    a whole one; every other damage raises an error. Formats with complicated parsers
    are read in another process, so that a damaged file can neither crash nor block the
    caller.

    Parameters
    ----------
    path : str or path-like
        The file.
    channel : str, int or sequence of these, default=None
        Name of the channel, or its position counted from 0; a text of digits is a
        position unless a channel bears that name. In a pattern such as ``*DE_time``,
        which must fit one channel, ``*`` stands for any characters and ``?`` for one.
        Of a sequence, the first is the output and the others are the inputs. None takes
        the only channel, apart from those of times and of the shaft speed, and is an
        error if there are several.
    dtype : str, default=None
        Type of the samples in a raw binary file without a header, as NumPy writes it:
        ``"<i2"`` for 16-bit integers with the lowest byte first, ``"(4,)<f4"`` for four
        interleaved channels of 32-bit floating-point numbers. The file is then raw
        whatever its name. Any other format states its types itself.

    Returns
    -------
    signal : ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        Two-dimensional if `channel` is a sequence.
    sampling_rate : float or None
        In Hz, if the file states it.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the format is not known or the file cannot be read (damaged, truncated,
        pickled, far larger when unpacked than a recording can be), if the channel is
        unknown or ambiguous, if its values are not numeric, complex, NaN or infinite,
        or of another length or sampling rate than those of the other channels, if the
        file states several sampling rates, and if times have gaps, fall, or change
        their rate by more than 1 %. The message names the file.
    ImportError
        If the library that the format needs is not installed. The message names the
        extra.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from skarxlag import read_recording
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "run_1.npz")
    ...     np.savez(path, emission=[0.5, -0.5, 0.25], torque=[4, 5, 6], fs=250000)
    ...     signal, sampling_rate = read_recording(path, channel=["emission", "torque"])
    >>> signal
    array([[ 0.5 , -0.5 ,  0.25],
           [ 4.  ,  5.  ,  6.  ]])
    >>> sampling_rate
    250000.0
    """
    facts, blocks = open_file(path, choices=[channel], dtype=dtype)
    (signal,) = blocks
    return signal, facts.sampling_rate


def iter_windows(
    path: StrPath,
    window_length: int = 1200,
    *,
    channel: Channels = None,
    dtype: str | None = None,
) -> Iterator[NDArray[Any]]:
    """Cut a recording of any length into windows, block by block.

    MATLAB files before version 7.3, ``.npz`` and universal files can only be read
    whole; windows of all other formats are read on demand.

    Parameters
    ----------
    path : str or path-like
        The file, see :func:`read_recording`.
    window_length : int, default=1200
        Samples in a window, at least 1. Windows neither overlap nor leave gaps; the
        tail of the recording that does not fill a window is left out.
    channel : str, int or sequence of these, default=None
        As in :func:`read_recording`.
    dtype : str, default=None
        As in :func:`read_recording`.

    Yields
    ------
    ndarray of float64, shape (n_windows, window_length) or (n_windows, n_channels,
    window_length)
        The next windows in time order, at most about a million samples of each channel.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`, when the samples in question are reached; and if
        the recording is shorter than one window.
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
    from .cutting import block_length, cut_blocks

    n_samples = block_length(window_length)
    _, blocks = open_file(path, n_samples, choices=[channel], dtype=dtype)
    yield from cut_blocks(blocks, str(path), window_length)


def list_channels(path: StrPath, *, dtype: str | None = None) -> "pd.DataFrame":
    r"""List the channels of a recording and what the file states about them.

    Parameters
    ----------
    path, dtype
        As in :func:`read_recording`.

    Returns
    -------
    pandas.DataFrame
        One row for each channel, in the order of the file, with the columns ``channel``
        (the name), ``sampling_rate`` (in Hz, NaN if it is not stated), ``unit`` (None
        if it is not stated) and ``rpm`` (shaft speed in rev/min, NaN if no number named
        ``rpm`` states it).

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skarxlag import list_channels
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "run.csv")
    ...     _ = path.write_text("time;vibration\ns;g\n0,000;1,5\n0,001;-2\n")
    ...     list_channels(path)
         channel  sampling_rate unit  rpm
    0       time            NaN    s  NaN
    1  vibration         1000.0    g  NaN
    """
    import pandas as pd

    columns = ["channel", "sampling_rate", "unit", "rpm"]
    table = pd.DataFrame(_answer(path, dtype, "table"), columns=columns, dtype=object)
    return table.astype({"sampling_rate": float, "rpm": float})


def _visit(path, dtype, function, *arguments):
    """Return an iterator of the results of a function of the contents of a file."""
    path = Path(path)
    file_format = find_format(path, dtype).FORMAT
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    if file_format.isolated:
        return isolated(read_file, path, dtype, function, *arguments)
    return read_file(path, dtype, function, *arguments)


def _answer(path, dtype, method, *arguments, stated_rate=None):
    """Return what a method of `FileVisit` returns."""
    ((result,),) = _visit(path, dtype, answer, stated_rate, method, *arguments)
    return result


def recording_speed(
    path: Any,
    *,
    channel: Any = None,
    dtype: Any = None,
    sampling_rate: float | None = None,
) -> float | SpeedProfile | None:
    """Return the shaft speed that the file states, see `FileVisit.speed`.

    Parameters
    ----------
    path, channel, dtype
        As in :func:`read_recording`; of several channels the first counts.
    sampling_rate : float or None
        Of the signal in Hz, if the file does not state it.

    Returns
    -------
    float, SpeedProfile or None
        In rev/min; None if the file does not state it.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`.
    """
    return _answer(path, dtype, "speed", channel, stated_rate=sampling_rate)


def names_of_channels(path: Any, channel: Any, dtype: Any) -> list[str]:
    """Return the names of the channels that are chosen as in :func:`read_recording`."""
    return _answer(path, dtype, "choose", channel)


def recording_start(
    path: Any, *, channel: Any = None, dtype: Any = None
) -> float | None:
    """Return the date of the first sample, if the file states one.

    Parameters
    ----------
    path, channel, dtype
        As in :func:`read_recording`; of several channels the first counts.

    Returns
    -------
    float or None
        Seconds since 1970.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`.
    """
    return _answer(path, dtype, "start", channel)


def open_file(
    path: Any,
    n_samples: int | None = None,
    *,
    choices: Sequence[Any] = (None,),
    dtype: str | None = None,
    stated_rate: float | None = None,
    reads_speed: bool = False,
) -> tuple[FileFacts, Iterator[NDArray[Any]]]:
    """Read the facts of a file, and return them with its samples, which follow in one visit.

    Parameters
    ----------
    path, dtype
        As in :func:`read_recording`.
    n_samples : int or None, default=None
        Samples of a block, at most, if the format can be read in parts. None: one block
        of all.
    choices : sequence
        Ways to state the channels. The first that the file has is taken.
    stated_rate : float or None, default=None
        Sampling rate in Hz that is stated outside the file.
    reads_speed : bool, default=False
        Whether the speed is read, too.

    Returns
    -------
    facts : FileFacts
        The facts.
    blocks : iterator of ndarray of shape (n_samples,) or (n_channels, n_samples)
        The samples.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in :func:`read_recording`; of the samples, when the block in question is
        reached.
    """
    options = (choices, n_samples, stated_rate, reads_speed)
    blocks = _visit(path, dtype, facts_and_samples, *options)
    return next(blocks), blocks
