"""Cut recordings into windows, the rows of X for every estimator of the package."""

from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array

from .validation import as_samples, check_count


@overload
def make_windows(
    recording: ArrayLike,
    window_length: int = ...,
    *,
    hop: int | None = ...,
    facts: None = ...,
) -> NDArray[Any]: ...
@overload
def make_windows(
    recording: Sequence[ArrayLike],
    window_length: int = ...,
    *,
    hop: int | None = ...,
    facts: Mapping[str, Any] | pd.DataFrame,
) -> tuple[NDArray[Any], pd.DataFrame]: ...
def make_windows(
    recording: Any,
    window_length: int = 1200,
    *,
    hop: int | None = None,
    facts: Mapping[str, Any] | pd.DataFrame | None = None,
) -> Any:
    r"""Cut a recording, or several of any length, into windows of equal length.

    Window :math:`w` holds the samples :math:`w h, \ldots, w h + L - 1` of the
    recording, with length :math:`L` and hop :math:`h`, so :math:`1 + \lfloor
    (n_\mathrm{samples} - L) / h \rfloor` windows fit. The tail that does not fill a
    window is left out.

    Parameters
    ----------
    recording : array-like of shape (n_samples,) or (n_channels, n_samples)
        Real, finite samples in any unit. Of several channels the first is the output
        and the others are the inputs. With `facts`, a sequence of recordings, which may
        differ in length.
    window_length : int, default=1200
        Samples in a window, at least 1. The default is the length that the estimators'
        defaults are meant for.
    hop : int, default=None
        Samples from the start of one window to the start of the next, at least 1. None
        takes `window_length`: windows neither overlap nor leave gaps.
    facts : DataFrame or mapping of str to sequence, default=None
        Facts of several recordings, such as ``rpm`` and ``condition``: one row, or one
        value in each sequence, for each of them. None: `recording` is one recording.

    Returns
    -------
    windows : ndarray of shape (n_windows[, n_channels], window_length)
        A fresh C-contiguous array in time order, recording after recording. float32
        stays float32, everything else becomes float64.
    table : DataFrame
        With `facts`: the facts of the recording of each window, its position in
        ``recording`` unless the facts have this name, and its first sample in
        ``start``. Its columns are what `fit` takes as ``y`` and ``rpm``, and
        cross-validation as ``groups``.

    Raises
    ------
    ValueError
        If a recording is shorter than one window, is not numeric, is complex, holds
        True and False, NaN, infinity or masked samples, or has more than two
        dimensions, if `window_length` or `hop` is below 1, and if the facts are not
        those of as many recordings.
    TypeError
        If `window_length` or `hop` is not an integer, or the recording is a single
        number.

    Examples
    --------
    >>> from skarxlag import make_windows
    >>> make_windows([0, 1, 2, 3, 4, 5, 6], 3)
    array([[0., 1., 2.],
           [3., 4., 5.]])
    >>> make_windows([0, 1, 2, 3, 4, 5, 6], 3, hop=2).shape
    (3, 3)
    >>> windows, table = make_windows([[0, 1, 2, 3, 4], [5, 6, 7]], 2, facts={"rpm": [300, 500]})
    >>> windows.tolist()
    [[0.0, 1.0], [2.0, 3.0], [5.0, 6.0]]
    >>> table
       rpm  recording  start
    0  300          0      0
    1  300          0      2
    2  500          1      0
    """
    if facts is not None:
        return _windows_of_all(recording, window_length, hop, facts)
    check_count(window_length, "window_length")
    hop = window_length if hop is None else check_count(hop, "hop")
    types = [np.float64, np.float32]
    try:
        recording = as_samples(recording, "recording")
    except ValueError as error:
        if "inhomogeneous" not in str(error):
            raise
        raise ValueError(
            "recording holds sequences of different lengths; to cut several recordings, "
            "state facts of each, as in facts={'rpm': [300, 500]}"
        ) from error
    signal = check_array(
        recording, dtype=types, ensure_2d=False, input_name="recording"
    )
    n_samples = signal.shape[-1]
    if n_samples < window_length:
        raise ValueError(
            f"recording has {n_samples} samples, fewer than window_length={window_length}; "
            f"its shape is {signal.shape}, expected (n_samples,) or (n_channels, n_samples)"
        )
    windows = np.lib.stride_tricks.sliding_window_view(signal, window_length, axis=-1)
    # Without the copy, the windows would be a read-only view of the recording.
    return np.moveaxis(windows[..., ::hop, :], -2, 0).copy(order="C")


def _windows_of_all(recordings, window_length, hop, facts):
    table = pd.DataFrame(facts).reset_index(drop=True)
    if len(table) != len(recordings):
        raise ValueError(
            f"facts are those of {len(table)} recordings, expected {len(recordings)}"
        )
    parts = []
    for i, recording in enumerate(recordings):
        try:
            parts.append(make_windows(recording, window_length, hop=hop))
        except ValueError as error:
            raise ValueError(f"recording {i}: {error}") from error
    counts = [len(windows) for windows in parts]
    rows = table.loc[np.repeat(table.index, counts)].reset_index(drop=True)
    if "recording" not in rows:
        rows["recording"] = np.repeat(np.arange(len(counts)), counts)
    rows["start"] = np.concatenate([np.arange(n) for n in counts]) * (
        window_length if hop is None else hop
    )
    return np.concatenate(parts), rows
