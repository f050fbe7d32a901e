"""File formats of data acquisition: the channels of one file, block after block."""

import warnings
from contextlib import contextmanager

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype
from scipy.io import loadmat, wavfile


def channel_blocks(path, n_samples=None):
    """Channels of one file, block after block, so that a long recording never is in memory whole.

    MATLAB and .npz files, and .wav of 24 bit, can only be read whole: they come as one block.

    Parameters
    ----------
    path : Path
        The file. Its suffix, in any case, tells the format.
    n_samples : int or None, default=None
        Samples of every channel in a block, at most. None: one block of all.

    Yields
    ------
    channels : dict of str to array
        What the file offers, as it is stored; integers of a .wav are divided by full scale.
    sampling_rate : float or None
        In Hz, where the format states it.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As in `read_recording`, when the block in question is reached.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise ValueError(
            f"{path}: unknown suffix {path.suffix!r}; expected one of {', '.join(_READERS)}"
        )
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    blocks = reader(path, n_samples)
    while True:
        with _file_named_in_errors(path):
            block = next(blocks, None)
        if block is None:
            return
        if not block[0]:
            raise ValueError(f"{path}: holds no numeric array of more than one value")
        yield block


@contextmanager
def _file_named_in_errors(path):
    try:
        yield
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
        if "pickle" in str(error) or "Python objects" in str(error):
            raise ValueError(
                f"{path}: holds pickled objects, which are refused because they can run code, or "
                "is damaged; expected plain numeric arrays"
            ) from error
        suffix = path.suffix.lower()
        raise ValueError(f"{path}: cannot be read as {suffix}, damaged? ({error})") from error


def _slices(n_total, n_samples):
    """Slices of all samples; one, though empty, where there is none."""
    step = max(n_total if n_samples is None else n_samples, 1)
    return (slice(start, start + step) for start in range(0, max(n_total, 1), step))


def _mat_blocks(path, n_samples):
    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are no channels.
        warnings.simplefilter("ignore")
        content = loadmat(path, appendmat=False)
    yield _numeric_channels(content), None


def _npz_blocks(path, n_samples):
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        content = np.load(file, allow_pickle=False)
        yield _numeric_channels({name: content[name] for name in content.files}), None


def _npy_blocks(path, n_samples):
    def read():
        return _split_matrix("", np.load(path, mmap_mode="r", allow_pickle=False))

    for part in _slices(len(next(iter(read().values()))), n_samples):
        # Mapped anew for each block: pages of the last one stay in memory as long as its map.
        yield {name: values[part] for name, values in read().items()}, None


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


def _csv_blocks(path, n_samples):
    first_line = read_csv_frame(path, header=None, nrows=1)
    has_header = not all(is_numeric_dtype(dtype) for dtype in first_line.dtypes)
    header = 0 if has_header else None
    if n_samples is None:
        yield _columns(read_csv_frame(path, header=header)), None
        return
    with read_csv_frame(path, header=header, chunksize=n_samples) as frames:
        while True:
            with _strict_parser():
                frame = next(frames, None)
            if frame is None:
                return
            yield _columns(frame), None


def read_csv_frame(path, **options):
    """Read a csv file with pandas, dropping neither blank lines nor surplus fields."""
    with _strict_parser():
        return pd.read_csv(
            path, index_col=False, skip_blank_lines=False, low_memory=False, **options
        )


@contextmanager
def _strict_parser():
    with warnings.catch_warnings():
        # By default surplus fields would turn the first column into an index.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        yield


def _parquet_blocks(path, n_samples):
    if n_samples is None:
        yield _columns(pd.read_parquet(path)), None
        return
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as file:
        for batch in file.iter_batches(n_samples):
            yield _columns(batch.to_pandas()), None


def _columns(frame):
    return {str(name): frame.iloc[:, i] for i, name in enumerate(frame.columns)}


def _wav_blocks(path, n_samples):
    sampling_rate, samples = _map_wav(path)
    if not isinstance(samples, np.memmap):
        n_samples = None
    for part in _slices(len(samples), n_samples):
        # As in _npy_blocks.
        block = (_map_wav(path)[1] if n_samples else samples)[part]
        if block.dtype == np.uint8:
            block = (block - 128.0) / 128.0
        elif block.dtype.kind == "i":
            # SciPy left-justifies odd widths (24 bit in int32), so full scale is the type's.
            block = block / -float(np.iinfo(block.dtype).min)
        columns = block[:, np.newaxis] if block.ndim == 1 else block
        yield {str(i): column for i, column in enumerate(columns.T)}, float(sampling_rate)


def _map_wav(path):
    with warnings.catch_warnings():
        # SciPy skips chunks of metadata with a warning, and warns of a truncated file alike.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            return wavfile.read(path, mmap=True)
        except ValueError:  # 24 bit cannot be mapped
            return wavfile.read(path)


_READERS = {
    ".mat": _mat_blocks,
    ".npy": _npy_blocks,
    ".npz": _npz_blocks,
    ".csv": _csv_blocks,
    ".wav": _wav_blocks,
    ".parquet": _parquet_blocks,
}
