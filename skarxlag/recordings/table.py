"""Tables of a user's own recordings, and the rig that they make."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from .files import recording_blocks
from .formats.text import read_csv_frame
from .windows import stack_windows

COLUMNS = ("path", "condition", "rpm", "sampling_rate", "channel")


@dataclass(frozen=True)
class ListedRecording:
    """One line of a table of recordings; nothing of the file has been read."""

    where: str
    name: str
    path: Path
    channel: str | list | None
    sampling_rate: float | None
    condition: str | None
    rpm: float | None

    def blocks(self, n_samples=None):
        """Blocks of the recording and its sampling rate, as `recording_blocks` yields them.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As there, and if table and file disagree on the sampling rate, or neither states it.
            The message names the table and the line.
        """
        try:
            for signal, known in recording_blocks(self.path, n_samples, channel=self.channel):
                yield signal, self._agreed_rate(known)
        except (FileNotFoundError, ImportError, ValueError) as error:
            raise type(error)(f"{self.where}: {error}") from error

    def _agreed_rate(self, known):
        if self.sampling_rate is None and known is None:
            raise ValueError(f"sampling_rate is missing and {self.path} does not state it")
        if None not in (self.sampling_rate, known) and self.sampling_rate != known:
            raise ValueError(
                f"sampling_rate is {self.sampling_rate:g} Hz but {self.path} states {known:g} Hz"
            )
        return known if self.sampling_rate is None else self.sampling_rate


def read_recording_table(path):
    r"""Read all recordings that a table lists.

    The table is a csv file (comma, UTF-8) with one recording in a line and these columns, of which
    only ``path`` must be there:

    - ``path``: the file, absolute or relative to the folder of the table; see
      :func:`read_recording` for the formats.
    - ``condition``: the state of the machine, any text. Needed to fit a diagnoser, not to diagnose.
    - ``rpm``: the shaft speed, rev/min.
    - ``sampling_rate``: in Hz, the same for all. Not needed for ``.wav``, which states it.
    - ``channel``: name or position of the channel; several are separated by ``;``, the output
      first and then the inputs. Empty takes the only channel of the file.

    A column that is there is filled in every line, except ``channel`` and ``sampling_rate``.

    Parameters
    ----------
    path : str or path-like
        The table.

    Returns
    -------
    table : :class:`~sklearn.utils.Bunch`
        With the following attributes, all in the order of the table.

        recordings : list of ndarray of float64
            Of shape (n_samples,) or, where several channels are named, (n_channels, n_samples).
            The number of samples may differ between recordings.
        condition : ndarray of str, or None
            None if the table has no such column.
        rpm : ndarray of float, or None
            None if the table has no such column.
        recording : list of str
            Id of each recording: its path as the table writes it, and the channel behind a colon
            if the table lists the file more than once.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files.

    Raises
    ------
    FileNotFoundError
        If the table, or a file that it lists, does not exist.
    ValueError
        If the table is empty, has an unknown column, an empty or wrong field, the same recording
        twice, differing sampling rates or numbers of channels, or a recording that
        :func:`read_recording` refuses. The message names the table, the line and the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag.recordings.table import read_recording_table
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "a.npy", np.zeros(5))
    ...     np.save(folder / "b.npy", np.ones(7))
    ...     lines = ["path,condition,rpm,sampling_rate", "a.npy,good,300,50e3",
    ...              "b.npy,worn,300,50e3"]
    ...     _ = (folder / "table.csv").write_text("\n".join(lines))
    ...     table = read_recording_table(folder / "table.csv")
    >>> table.condition
    array(['good', 'worn'], dtype='<U4')
    >>> [signal.shape for signal in table.recordings]
    [(5,), (7,)]
    """
    listed = list_recordings(path)
    recordings, rates = [], []
    for entry in listed:
        for signal, sampling_rate in entry.blocks():
            recordings.append(signal)
            rates.append(sampling_rate)
    _check_equal(listed, "sampling rates (Hz)", rates)
    shapes = [1 if signal.ndim == 1 else len(signal) for signal in recordings]
    _check_equal(listed, "numbers of channels", shapes)
    first = listed[0]
    return Bunch(
        recordings=recordings,
        condition=None if first.condition is None else np.array([e.condition for e in listed]),
        rpm=None if first.rpm is None else np.array([entry.rpm for entry in listed]),
        recording=[entry.name for entry in listed],
        sampling_rate=rates[0],
        filenames=[str(entry.path) for entry in listed],
    )


def list_recordings(path):
    """Lines of a table, without reading the recordings.

    Parameters
    ----------
    path : str or path-like
        The table, see :func:`read_recording_table`.

    Returns
    -------
    list of ListedRecording
        In the order of the table.

    Raises
    ------
    FileNotFoundError, ValueError
        As in :func:`read_recording_table`, as far as the table itself is at fault.
    """
    path = Path(path)
    table = _read_table(path)
    repeated = table["path"].duplicated(keep=False)
    listed = []
    for line, row in table.iterrows():
        where = f"{path}, line {line}"
        channel = [each.strip() for each in row["channel"].split(";")] if row["channel"] else [None]
        rate, rpm = row["sampling_rate"], row.get("rpm")
        listed.append(
            ListedRecording(
                where=where,
                name=f"{row['path']}:{row['channel']}" if repeated[line] else row["path"],
                path=path.parent / row["path"],
                channel=channel if len(channel) > 1 else channel[0],
                sampling_rate=_positive(where, "sampling_rate", rate) if rate else None,
                condition=row.get("condition"),
                rpm=None if rpm is None else _positive(where, "rpm", rpm),
            )
        )
    return listed


def load_recordings(path, *, window_length=1200, hop=None, healthy=None):
    r"""Load a user's own recordings as a rig: the windows of all recordings of a table.

    Parameters
    ----------
    path : str or path-like
        The table, see :func:`read_recording_table`.
    window_length : int, default=1200
        Samples in a window.
    hop : int, default=None
        Samples from the start of one window to the start of the next. None takes
        `window_length`. The tail of a recording that does not fill a window is left out.
    healthy : str, default=None
        The healthy condition. None takes the condition in the first line of the table.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        With the following attributes.

        data : ndarray of float64, shape (n_windows[, n_channels], window_length)
            Windows: recording after recording, in time order within each.
        target : ndarray of str, shape (n_windows,), or None
            Condition of each window. None if the table has no conditions.
        target_names : list of str
            The conditions, the healthy one first, then in the order of the table.
        rpm : ndarray of float, shape (n_windows,), or None
            Shaft speed, rev/min. None if the table has no speeds.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files, in the order of the table.
        DESCR : str
            Which table this is.

    Raises
    ------
    FileNotFoundError, ValueError
        As in :func:`read_recording_table`; if a recording is shorter than one window; and if
        `healthy` is not a condition of the table.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag.recordings.table import load_recordings
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "a.npy", np.zeros(5))
    ...     lines = ["path,condition,sampling_rate", "a.npy,good,50e3"]
    ...     _ = (folder / "table.csv").write_text("\n".join(lines))
    ...     rig = load_recordings(folder / "table.csv", window_length=2)
    >>> rig.data.shape, rig.target, rig.start
    ((2, 2), array(['good', 'good'], dtype='<U4'), array([0, 2]))
    """
    table = read_recording_table(path)
    conditions = [] if table.condition is None else list(dict.fromkeys(table.condition.tolist()))
    if healthy is not None:
        if healthy not in conditions:
            raise ValueError(f"healthy={healthy!r} is not a condition of {path}: {conditions}")
        conditions.sort(key=lambda condition: condition != healthy)
    data, source, start = stack_windows(table.recordings, table.filenames, window_length, hop=hop)
    return Bunch(
        data=data,
        target=None if table.condition is None else table.condition[source],
        target_names=conditions,
        rpm=None if table.rpm is None else table.rpm[source],
        recording=np.array(table.recording)[source],
        start=start,
        sampling_rate=table.sampling_rate,
        filenames=table.filenames,
        DESCR=f"{len(table.recordings)} recordings listed in {path}, cut into windows",
    )


def _read_table(path):
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        table = read_csv_frame(path, dtype=str, keep_default_na=False, encoding="utf-8-sig")
    except (ValueError, pd.errors.ParserWarning) as error:
        raise ValueError(f"{path}: cannot be read as a csv table ({error})") from error
    table = table.rename(columns=str.strip).apply(lambda column: column.str.strip())
    unknown = [name for name in table.columns if name not in COLUMNS]
    if unknown or "path" not in table:
        raise ValueError(
            f"{path}: columns {list(table.columns)}, expected 'path' and any of {COLUMNS[1:]}"
        )
    # Rows bear the number of their line, the header being the first, for error messages.
    table.index += 2
    table = table[(table != "").any(axis=1)]
    if table.empty:
        raise ValueError(f"{path}: lists no recording")
    for name in table.columns.intersection(["path", "condition", "rpm"]):
        empty = table.index[table[name] == ""]
        if len(empty):
            raise ValueError(f"{path}, line {empty[0]}: {name} is empty")
    table = table.assign(
        **{name: "" for name in ("sampling_rate", "channel") if name not in table.columns}
    )
    twice = table.index[table.duplicated(["path", "channel"])]
    if len(twice):
        row = table.loc[twice[0]]
        raise ValueError(f"{path}, line {twice[0]}: {row['path']} is listed a second time")
    return table


def _positive(where, name, text):
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{where}: {name} is {text!r}, expected a positive number")
    return value


def _check_equal(listed, what, values):
    for entry, value in zip(listed, values, strict=True):
        if value != values[0]:
            raise ValueError(
                f"{entry.where}: different {what}: {value:g}, but {values[0]:g} in "
                f"{listed[0].where}"
            )
