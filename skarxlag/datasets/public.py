"""Public rigs, as the package bearing-datasets builds them: one schema for all of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from ..core.state import expect
from ..core.validation import check_count
from .frames import in_form

#: Names of this package for those of the schema.
_FAULTS = {"normal": "healthy", "rolling_element": "ball"}
#: Columns of the schema with the orders of a bearing, and our names for them.
_ORDERS = {"ftf": "cage", "bsf": "spin", "bpfi": "inner", "bpfo": "outer"}


def load_public_rig(
    name: str,
    *,
    root: str | os.PathLike[str] | None = None,
    channel: str | None = None,
    where: str | None = None,
    condition: str | Sequence[str] = "fault_type",
    window_length: int = 1200,
    return_X_y: bool = False,
    as_frame: bool = False,
) -> Any:
    """Load the recordings of a public rig, cut into windows.

    The package `bearing-datasets` downloads more than sixty public data sets, checks
    them, and stores them in one schema: ``bearing-datasets build paderborn --root
    FOLDER``. Its table states the rate, the speed, the load and the physical bearing of
    each recording, and the terms of use of each data set. This function never downloads.

    Parameters
    ----------
    name : str
        Name of a built data set, such as "cwru", "hit_sm", "uestc", "mfpt" or
        "paderborn".
    root : str or path-like, default=None
        Folder of the built data sets. None: the one that `bearing-datasets` is set to.
    channel : str or None, default=None
        Channel to take of each recording. None: its only channel.
    where : str or None, default=None
        Condition on the columns of the metadata, as `pandas.DataFrame.query` takes it,
        such as ``"sensor_at_fault and fs == 12000"``. None: all recordings.
    condition : str or sequence of str, default="fault_type"
        Columns of the metadata that make the condition of a recording. The texts of
        several columns are joined, and "none" is left out. The fault types "normal" and
        "rolling_element" are called "healthy" and "ball".
    window_length : int, default=1200
        Samples in a window. Windows do not overlap. Samples at the end of a recording
        that do not fill a window are not used.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    as_frame : bool, default=False
        If True, the Bunch has the table `frame`.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings, with the following attributes.

        data : ndarray of float64, shape (n_windows, window_length)
            Windows of one recording are consecutive and in time order.
        target : ndarray of str, shape (n_windows,)
            Condition of each window.
        target_names : list of str
            The conditions, the healthy one first.
        rpm, recording, start, specimen, load : ndarray of shape (n_windows,)
            Speed in revolutions per minute, recording, index of the first sample there,
            physical bearing, and load of each window. NaN if they are not stated.
        frame : DataFrame of n_windows rows
            These five as a table, if `as_frame` is True. Splitters take its columns as
            `groups`.
        sampling_rate : float
            In Hz.
        bearing : dict of str to float or None
            Orders of the bearing, as `skarxlag.bearing_orders` takes them. None if they
            are not the same for all recordings, or not known.
        DESCR : str
            Title, work to cite and licence.
    (data, target) : tuple
        The windows and their conditions, if `return_X_y` is True.

    Raises
    ------
    ImportError
        If `bearing-datasets` is not installed.
    FileNotFoundError
        If the data set is not built in `root`.
    ValueError
        If no signal is left, a recording has several channels and none is chosen, rates
        differ, or a recording is shorter than a window.

    Examples
    --------
    >>> from skarxlag.datasets import load_public_rig
    >>> rig = load_public_rig("uestc", root="rigs")  # doctest: +SKIP
    >>> sorted(set(rig.rpm))  # doctest: +SKIP
    [800.0, 1000.0, 1200.0, 1400.0]
    """
    check_count(window_length, "window_length")
    dataset = _open(name, root)
    signals = _chosen_signals(dataset, channel, where)
    conditions = _conditions(
        signals, [condition] if isinstance(condition, str) else condition
    )
    windows = []
    for _, samples in dataset.iter_signals(signals["signal_id"], dtype=np.float64):
        n_windows = len(samples) // window_length
        windows.append(samples[: n_windows * window_length].reshape(-1, window_length))
    counts = np.array([len(part) for part in windows])
    short = signals["recording_id"][counts == 0].tolist()
    expect(not short, "Recordings shorter than window_length", short[:5], "none")
    row = np.repeat(np.arange(len(signals)), counts)
    specimen = signals.get("bearing_id", conditions)
    starts = [window_length * np.arange(count) for count in counts]
    manifest = dataset.manifest
    rig = Bunch(
        data=np.concatenate(windows),
        target=conditions.to_numpy(dtype=str)[row],
        target_names=sorted(
            set(conditions), key=lambda text: (text != "healthy", text)
        ),
        rpm=_column(signals, "speed_rpm")[row].astype(float),
        recording=signals["recording_id"].to_numpy(dtype=str)[row],
        start=np.concatenate(starts),
        specimen=specimen.to_numpy(dtype=str)[row],
        load=_column(signals, "load")[row],
        sampling_rate=float(signals["fs"].iloc[0]),
        bearing=_orders(signals),
        DESCR=f"{manifest['title']}\n{manifest['citation']}\nLicence: {manifest['license']}",
    )
    return in_form(rig, return_X_y=return_X_y, as_frame=as_frame)


def _open(name, root):
    try:
        import bearing_datasets
    except ImportError as error:
        raise ImportError(
            "Public rigs need the package bearing-datasets: pip install 'skarxlag[rigs]'."
        ) from error
    return bearing_datasets.open(name, root)


def _chosen_signals(dataset, channel, where):
    """Return the metadata of one signal of each recording, all of one sampling rate."""
    signals = dataset.metadata()
    if where is not None:
        signals = signals.query(where)
    if channel is not None:
        is_channel = signals["channel"] == channel
        names = sorted(signals["channel"].unique())
        expect(is_channel.any(), "channel", channel, f"one of {names}")
        signals = signals[is_channel]
    expect(len(signals) > 0, "where", where, "a condition that some signal fulfils")
    of_recordings = signals.groupby("recording_id")["channel"]
    if of_recordings.size().max() > 1:
        names = sorted(signals["channel"].unique())
        raise ValueError(
            f"The recordings of {dataset.name} have several channels: {names}. Choose one "
            "by channel."
        )
    rates = sorted(signals["fs"].unique().tolist())
    if len(rates) > 1:
        raise ValueError(
            f"The recordings of {dataset.name} have several sampling rates: {rates} Hz. "
            "Choose one by where, such as 'fs == 12000'."
        )
    return signals.reset_index(drop=True)


def _column(signals, name):
    """Return a column of the metadata, or NaN if the data set does not state it."""
    return signals.get(name, pd.Series(np.nan, signals.index)).to_numpy()


def _conditions(signals, columns):
    """Return the condition of each recording, made of some columns."""
    unknown = [name for name in columns if name not in signals]
    expect(not unknown, "condition", unknown, f"columns among {list(signals)}")
    texts = pd.DataFrame({name: signals[name].astype(str) for name in columns})
    for fault, ours in _FAULTS.items():
        texts = texts.replace(rf"\b{fault}\b", ours, regex=True)
    return texts.apply(
        lambda row: " ".join(part for part in row if part != "none"), axis=1
    )


def _orders(signals):
    """Return the orders of the bearing of all recordings, or None."""
    if not {*_ORDERS} <= {*signals.columns}:
        return None
    orders = signals[[*_ORDERS]].drop_duplicates()
    if len(orders) > 1:
        return None
    values = orders.astype(float).iloc[0]
    return {ours: float(values[theirs]) for theirs, ours in _ORDERS.items()}
