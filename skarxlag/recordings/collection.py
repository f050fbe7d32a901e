"""The signals of all recordings of a table or a folder."""

import os
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from .listing import ListedRecording
from .rates import rates_agree, resampled_blocks
from .table import list_recordings


def read_recording_table(
    path: str | os.PathLike[str],
    *,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
    resample: float | None = None,
) -> Bunch:
    r"""Read all recordings that a table, a folder or a glob lists.

    The table is a text file (UTF-8) with one recording in a line. Its separator is the comma, the
    semicolon or the tabulator, whichever its first line holds most of. These are its columns, in
    any order and any case, of which only ``path`` must be there:

    - ``path``: the file, absolute or relative to the folder of the table; see
      :func:`read_recording` for the formats.
    - ``condition``: the state of the machine, any text. Needed to fit a diagnoser, not to diagnose.
    - ``rpm``: the shaft speed, rev/min.
    - ``sampling_rate``: in Hz. Not needed where the file states it; where both do, they must agree
      within 0.1 %.
    - ``channel``: name, position or pattern of the channel, see :func:`read_recording`; several are
      separated by ``;``, the output first and then the inputs. Empty takes the only channel of the
      file.
    - ``dtype``: type of the samples of a raw binary file, see :func:`read_recording`.

    Any other column is kept and comes back as it is. A column that is there is filled in every
    line, except ``channel``, ``sampling_rate``, ``dtype`` and columns of other names.

    Parameters
    ----------
    path : str or path-like
        The table. Or, instead of a table: a folder, of which all files with a known suffix are
        read, also in folders below; or a glob such as ``runs/*/acc_*.tdms``.
    pattern : str, default=None
        For a folder or a glob: a regular expression that is searched for in the path of each file
        (below the folder, with ``/``). Its named groups give ``condition``, ``rpm``,
        ``sampling_rate`` and ``channel``; groups of other names are kept like unknown columns.
        ``(?P<condition>[A-Z]+)_(?P<rpm>\d+)`` fits ``OR_1200.mat``.
    channel, sampling_rate, dtype : default=None
        For a folder or a glob: the same for all recordings, unless the pattern tells.
    resample : float, default=None
        Sampling rate in Hz that all recordings are brought to by a polyphase filter, see
        :func:`skarxlag.recordings.rates.resampled_blocks`. None leaves them as they are, and
        differing rates are an error.

    Returns
    -------
    table : :class:`~sklearn.utils.Bunch`
        With the following attributes, all in the order of the table or of the paths.

        recordings : list of ndarray of float64
            Of shape (n_samples,) or, where several channels are named, (n_channels, n_samples).
            The number of samples may differ between recordings.
        condition : ndarray of str, or None
            None if the conditions are not told.
        rpm : ndarray of float, or None
            None if the speeds are not told.
        recording : list of str
            Id of each recording: its path as the table writes it, and the channel behind a colon
            if the table lists the file more than once.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files.
        further : DataFrame
            The columns of other names, one row for each recording, texts.
        resampled : dict of str to float
            The recordings that were resampled, and the rates in Hz that they had.

    Raises
    ------
    FileNotFoundError
        If the table, or a file that it lists, does not exist.
    ValueError
        If the table is empty, misspells a column, has an empty or wrong field, the same recording
        twice, differing sampling rates or numbers of channels, or a recording that
        :func:`read_recording` refuses; and if `pattern` does not fit a file or is given for a
        table. The message names the table, the line and the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag.recordings import read_recording_table
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "a.npy", np.zeros(5))
    ...     np.save(folder / "b.npy", np.ones(7))
    ...     lines = ["path,condition,rpm,sampling_rate,load", "a.npy,good,300,50e3,low",
    ...              "b.npy,worn,300,50e3,high"]
    ...     _ = (folder / "table.csv").write_text("\n".join(lines))
    ...     table = read_recording_table(folder / "table.csv")
    >>> table.condition
    array(['good', 'worn'], dtype='<U4')
    >>> [signal.shape for signal in table.recordings]
    [(5,), (7,)]
    >>> table.further["load"].tolist()
    ['low', 'high']
    """
    listed = list_recordings(
        path, pattern=pattern, channel=channel, sampling_rate=sampling_rate, dtype=dtype
    )
    facts = CommonFacts(listed)
    recordings = []
    for entry in listed:
        recordings.append(
            np.concatenate(list(facts.checked_blocks(entry, None, resample)), axis=-1)
        )
    return Bunch(recordings=recordings, **facts.described())


class CommonFacts:
    """What all recordings of a list must have in common, checked while they are read.

    Parameters
    ----------
    listed : list of ListedRecording
        The recordings.
    """

    def __init__(self, listed: list[ListedRecording]) -> None:
        self._listed, self._common, self._resampled = listed, {}, {}

    def checked_blocks(
        self, entry: ListedRecording, n_samples: int | None, resample: float | None
    ) -> Iterator[NDArray[Any]]:
        """Signals of a recording, of which the sampling rate and the channels are checked."""
        blocks = entry.blocks(n_samples)
        if resample is not None:
            note = partial(self._resampled.__setitem__, entry.name)
            blocks = resampled_blocks(blocks, resample, note=note)
        try:
            for signal, rate in blocks:
                if rate is None:
                    raise ValueError("sampling_rate is missing and the file does not state it")
                self._check(entry, "sampling rates (Hz)", rate, rates_agree)
                n_channels = 1 if signal.ndim == 1 else len(signal)
                self._check(entry, "numbers of channels", n_channels, int.__eq__)
                yield signal
        except ValueError as error:
            where = entry.where or str(entry.path)
            if str(error).startswith(where):
                raise
            raise ValueError(f"{where}: {error}") from error

    def described(self) -> dict[str, Any]:
        """What is known of the recordings besides their samples."""
        listed = self._listed
        conditions = [entry.condition for entry in listed]
        speeds = [entry.rpm for entry in listed]
        return {
            "condition": None if None in conditions else np.array(conditions),
            "rpm": None if None in speeds else np.array(speeds),
            "recording": [entry.name for entry in listed],
            "sampling_rate": self._common["sampling rates (Hz)"][0],
            "filenames": [str(entry.path) for entry in listed],
            "further": pd.DataFrame(
                [entry.further for entry in listed], index=[entry.name for entry in listed]
            ),
            "resampled": self._resampled,
        }

    def _check(self, entry, what, value, agree):
        first, where = self._common.setdefault(what, (value, entry.where or entry.path))
        if not agree(value, first):
            raise ValueError(f"different {what}: {value:g}, but {first:g} in {where}")
