"""File formats of data acquisition: the channels of one file, block after block."""

from contextlib import contextmanager

from . import matlab, npy, npz, parquet, text, wav

#: A format is a module with `SUFFIXES`, in lower case, and `blocks(path, n_samples)`.
_FORMATS = (matlab, npy, npz, text, wav, parquet)
_READERS = {suffix: module.blocks for module in _FORMATS for suffix in module.SUFFIXES}


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
