"""Readers of recordings in the file formats of data acquisition: one file, its channels."""

import warnings
from numbers import Integral
from pathlib import Path

import numpy as np
import pandas as pd
from pandas.api.types import is_bool_dtype, is_numeric_dtype
from scipy.io import loadmat, wavfile


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
    path = Path(path)
    channels, sampling_rate = _read_channels(path)
    if channel is None:
        if len(channels) > 1:
            raise ValueError(
                f"{path}: several channels and none chosen; available: {_listed(channels)}"
            )
        return _check_signal(path, *next(iter(channels.items()))), sampling_rate
    if isinstance(channel, str | Integral):
        return _check_signal(path, *_choose(path, channels, channel)), sampling_rate
    chosen = [_choose(path, channels, each) for each in channel]
    if not chosen:
        raise ValueError(f"{path}: channel is an empty sequence; available: {_listed(channels)}")
    signals = [_check_signal(path, *each) for each in chosen]
    lengths = {name: len(signal) for (name, _), signal in zip(chosen, signals, strict=True)}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"{path}: channels of different length, in samples: {lengths}")
    return np.stack(signals), sampling_rate


def _read_channels(path):
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise ValueError(
            f"{path}: unknown suffix {path.suffix!r}; expected one of {', '.join(_READERS)}"
        )
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        channels, sampling_rate = reader(path)
    except ImportError as error:
        raise ImportError(
            f"{path}: reading .parquet needs pyarrow: pip install 'skarxlag[io]'"
        ) from error
    except NotImplementedError as error:
        raise ValueError(
            f"{path}: a MATLAB v7.3 (HDF5) file; save it with save(..., '-v7') in MATLAB, or "
            "read it with h5py and store the arrays with numpy.savez"
        ) from error
    # What parsers raise on damaged input is as varied as the damage, and none names the file.
    except Exception as error:
        if "pickle" in str(error):
            raise ValueError(
                f"{path}: holds pickled objects, which are refused because they can run code, or "
                "is damaged; expected plain numeric arrays"
            ) from error
        suffix = path.suffix.lower()
        raise ValueError(f"{path}: cannot be read as {suffix}, damaged? ({error})") from error
    if not channels:
        raise ValueError(f"{path}: holds no numeric array of more than one value")
    return channels, sampling_rate


def _read_mat(path):
    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are no channels.
        warnings.simplefilter("ignore")
        content = loadmat(path, appendmat=False)
    return _numeric_channels(content), None


def _read_numpy(path):
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        content = np.load(file, allow_pickle=False)
        if isinstance(content, np.ndarray):
            return _split_matrix("", content), None
        return _numeric_channels({name: content[name] for name in content.files}), None


def _numeric_channels(content):
    channels = {}
    for name, values in content.items():
        if isinstance(values, np.ndarray) and values.dtype.kind in "fiuc" and values.size > 1:
            channels |= _split_matrix(name, values)
    return channels


def _split_matrix(name, values):
    values = np.squeeze(values) if values.size > 1 else values.reshape(-1)
    if values.ndim == 1:
        return {name or "0": values}
    if values.ndim > 2 or values.shape[0] == values.shape[1]:
        raise ValueError(
            f"array {name!r} of shape {values.shape}: expected a vector, or a matrix that is "
            "longer in time than in channels"
        )
    rows = values if values.shape[0] < values.shape[1] else values.T
    return {f"{name}[{i}]" if name else str(i): row for i, row in enumerate(rows)}


def _read_csv(path):
    first_line = read_csv_frame(path, header=None, nrows=1)
    has_header = not all(is_numeric_dtype(dtype) for dtype in first_line.dtypes)
    return _columns(read_csv_frame(path, header=0 if has_header else None)), None


def read_csv_frame(path, **options):
    """Read a csv file with pandas, dropping neither blank lines nor surplus fields."""
    with warnings.catch_warnings():
        # By default surplus fields would turn the first column into an index.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        return pd.read_csv(
            path, index_col=False, skip_blank_lines=False, low_memory=False, **options
        )


def _read_parquet(path):
    return _columns(pd.read_parquet(path)), None


def _columns(frame):
    return {str(name): frame.iloc[:, i] for i, name in enumerate(frame.columns)}


def _read_wav(path):
    with warnings.catch_warnings():
        # SciPy skips chunks of metadata with a warning, and warns of a truncated file alike.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        sampling_rate, samples = wavfile.read(path)
    if samples.dtype == np.uint8:
        samples = (samples - 128.0) / 128.0
    elif samples.dtype.kind == "i":
        # SciPy left-justifies odd widths (24 bit in int32), so full scale is that of the type.
        samples = samples / -float(np.iinfo(samples.dtype).min)
    columns = samples[:, np.newaxis] if samples.ndim == 1 else samples
    return {str(i): column for i, column in enumerate(columns.T)}, float(sampling_rate)


_READERS = {
    ".mat": _read_mat,
    ".npy": _read_numpy,
    ".npz": _read_numpy,
    ".csv": _read_csv,
    ".wav": _read_wav,
    ".parquet": _read_parquet,
}


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


def _check_signal(path, name, values):
    where = f"{path}: channel {name!r}"
    if not is_numeric_dtype(values.dtype) or is_bool_dtype(values.dtype):
        raise ValueError(f"{where} is not numeric{_first_text(values)}")
    if np.issubdtype(getattr(values.dtype, "numpy_dtype", values.dtype), np.complexfloating):
        raise ValueError(f"{where} is complex; store its real part or its magnitude")
    if isinstance(values, pd.Series):
        values = values.to_numpy(dtype=np.float64, na_value=np.nan)
    signal = np.array(values, dtype=np.float64)
    if signal.size == 0:
        raise ValueError(f"{where} is empty")
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        raise ValueError(
            f"{where} has {bad.size} missing, NaN or infinite values, the first at sample {bad[0]}"
        )
    return signal


def _first_text(values):
    if not isinstance(values, pd.Series):
        return f" but of type {values.dtype}"
    bad = np.flatnonzero(pd.to_numeric(values, errors="coerce").isna() & values.notna())
    return f": {values.iloc[bad[0]]!r} at sample {bad[0]}" if bad.size else ""
