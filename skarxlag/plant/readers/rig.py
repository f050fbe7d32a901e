"""Read the signals or the windows of all recordings of a table, a folder or a glob."""

import os
from collections.abc import Sequence

import numpy as np
from sklearn.utils import Bunch

from .cutting import Reader, cut_recordings
from .listing import list_recordings
from .repeated import check_repeated


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

    The table is a text file (UTF-8) with one recording in a line. Its separator is the
    comma, the semicolon or the tabulator, whichever its first line holds most of. These
    are its columns, in any order and any case, of which only ``path`` must be there:

    - ``path``: the file, absolute or relative to the folder of the table; see
      :func:`read_recording` for the formats.
    - ``condition``: the state of the machine, any text. Needed to fit a diagnoser, not
      to diagnose. Texts that differ only in blanks or invisible characters are equal.
    - ``specimen``: the bearing, any text. Recordings of one bearing have the same
      specimen, also if its condition changed. Without this column, each condition is
      one specimen.
    - ``load``: the load of the machine, a number or a text.
    - ``rpm``: the shaft speed, rev/min. Not needed if the file states it in a number or
      channel called ``rpm``. ``tacho:CHANNEL`` takes it from the pulses of a tachometer
      in that channel; a csv file with the columns ``rpm`` and ``recording`` or ``time``
      may state it, too.
    - ``pulses_per_revolution``: pulses of the tachometer in a revolution of the shaft; 1 if it is
      not stated.
    - ``sampling_rate``: in Hz, or in the unit that a column ``sampling_rate_unit``
      states, such as kHz. Not needed if the file states it; if both do, they must agree
      within 0.1 %.
    - ``channel``: name, position or pattern of the channel, see :func:`read_recording`;
      several are separated by ``;``, the output first and then the inputs. Empty takes
      the only channel of the file.
    - ``dtype``: type of the samples of a raw binary file, see :func:`read_recording`.

    Any other column is kept and comes back as it is. A column that is there is filled
    in every line, except ``load``, ``channel``, ``sampling_rate``, ``dtype`` and
    columns of other names.

    Parameters
    ----------
    path : str or path-like
        The table. Or, instead of a table: a folder, of which all files with a known
        suffix are read, also in folders below; or a glob such as ``runs/*/acc_*.tdms``.
    pattern : str, default=None
        For a folder or a glob: a regular expression that is searched for in the path of
        each file (below the folder, with ``/``). Its named groups are ``condition``,
        ``specimen``, ``load``, ``rpm``, ``sampling_rate`` and ``channel``; groups of
        other names are kept like unknown columns.
        ``(?P<condition>[A-Z]+)_(?P<rpm>\d+)`` fits ``OR_1200.mat``.
    channel, sampling_rate, dtype : default=None
        Of all recordings for which neither the table nor the pattern states it.
    resample : float, default=None
        Sampling rate in Hz to which a polyphase filter resamples all recordings, see
        :func:`skarxlag.plant.readers.resampling.resampled_blocks`. None leaves them as they
        are, and differing rates are an error.

    Returns
    -------
    table : :class:`~sklearn.utils.Bunch`
        With the following attributes, all in the order of the table or of the paths.

        recordings : list of ndarray of float64
            Of shape (n_samples,) or, if several channels are named, (n_channels,
            n_samples). The number of samples may differ between recordings.
        condition : ndarray of str, or None
            None if the conditions are not stated.
        specimen : ndarray of str, or None
            The condition if no specimen is stated. None if neither is stated.
        load : ndarray of float or of str
            Texts if one of the loads is no number. A load that is not stated is NaN, or
            empty among texts.
        rpm : ndarray of float, or None
            Mean speeds. None if the speed of a recording is stated neither outside the
            file nor in it.
        profiles : dict of str to tuple of two ndarrays
            Times since the first sample in seconds, and speeds, of the recordings of
            which a channel or a log states the speed over time.
        recording : list of str
            Id of each recording: its path as in the table, followed by a colon and the
            channel if the table lists the file more than once.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files.
        further : DataFrame
            The columns of other names, one row for each recording, texts.
        resampled : dict of str to float
            The recordings that were resampled, and the rates in Hz that they had.
        channels : list of list of tuple of str
            Name and unit of each channel of each recording. A unit that the file does
            not state is None.

    Raises
    ------
    FileNotFoundError
        If the table, or a file that it lists, does not exist.
    ValueError
        If the table is empty, misspells a column, has an empty or wrong field, the same
        recording twice (also by a link or a copy), differing sampling rates or numbers
        of channels, or a recording that :func:`read_recording` refuses; if `pattern`
        does not fit a file or is given for a table; and if each line of a table states
        what an argument states. The message names the table, the line and the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag import read_recording_table
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
    >>> table.load.tolist()
    ['low', 'high']
    """
    listed = list_recordings(
        path, pattern=pattern, channel=channel, sampling_rate=sampling_rate, dtype=dtype
    )
    check_repeated(listed)
    reader = Reader(resample)
    recordings = [
        np.concatenate([*reader.blocks(entry, None)], axis=-1) for entry in listed
    ]
    return Bunch(recordings=recordings, **reader.facts())


def load_recordings(
    path: str | os.PathLike[str],
    *,
    window_length: int = 1200,
    max_windows: int | None = None,
    healthy: str | None = None,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
    resample: float | None = None,
) -> Bunch:
    r"""Load the windows of all recordings of a table, a folder or a glob, as a rig.

    Recordings are read block by block, so that memory holds no more than the windows.
    If these are too many, reduce their number by `max_windows`.

    Parameters
    ----------
    path : str or path-like
        The table, a folder or a glob, see :func:`read_recording_table`.
    window_length : int, default=1200
        Samples in a window. Windows neither overlap nor leave gaps; the tail of a
        recording that does not fill a window is left out.
    max_windows : int, default=None
        Windows of each recording, at most, at least 1. Of a recording that has more,
        every second, fourth, eighth, ... window is kept, so that they are spread over
        all of it. None keeps all.
    healthy : str, default=None
        The healthy condition. None takes the condition in the first line of the table.
    pattern, channel, sampling_rate, dtype, resample
        As in :func:`read_recording_table`.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        With the following attributes.

        data : ndarray of float64, shape (n_windows[, n_channels], window_length)
            Windows: recording after recording, in time order within each.
        target : ndarray of str, shape (n_windows,), or None
            Condition of each window. None if the table has no conditions.
        specimen : ndarray of str, shape (n_windows,), or None
            Bearing of each window: its condition if no specimen is stated. None if
            neither is stated.
        load : ndarray of float or of str, shape (n_windows,)
            Load of each window. Texts if one of the loads is no number. A load that is
            not stated is NaN, or empty among texts.
        target_names : list of str
            The conditions, the healthy one first, then in the order of the table.
        rpm : ndarray of float, shape (n_windows,), or None
            Mean shaft speed of the window, rev/min. None if the speed of a recording is
            not known.
        profiles : dict of str to tuple of two ndarrays
            As in :func:`read_recording_table`.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording, counted after
            resampling.
        available : ndarray of int, shape (n_recordings,)
            Windows that there are in each recording; `max_windows` may have kept fewer.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files, in the order of the table.
        further : DataFrame
            The table's columns of other names, one row for each recording.
        resampled : dict of str to float
            The recordings that were resampled, and the rates in Hz that they had.
        channels : list of list of tuple of str
            Name and unit of each channel of each recording. A unit that the file does
            not state is None.
        DESCR : str
            Which table this is, and what was left out or resampled.

    Raises
    ------
    FileNotFoundError, ValueError
        As in :func:`read_recording_table`; if a recording is shorter than one window;
        if `max_windows` is below 1; and if `healthy` is not a condition of the table.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag import load_recordings
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "good_300.npy", np.zeros(5))
    ...     rig = load_recordings(folder, window_length=2, sampling_rate=50e3,
    ...                           pattern=r"(?P<condition>[a-z]+)_(?P<rpm>\d+)")
    >>> rig.data.shape, rig.target, rig.start
    ((2, 2), array(['good', 'good'], dtype='<U4'), array([0, 2]))
    """
    listed = list_recordings(
        path, pattern=pattern, channel=channel, sampling_rate=sampling_rate, dtype=dtype
    )
    return cut_recordings(listed, path, window_length, max_windows, healthy, resample)
