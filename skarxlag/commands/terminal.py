"""The verdicts as a table that fits the width of the terminal."""

import shutil
import sys

import pandas as pd

_PERCENTAGES = ("confidence", "alarms")
_SHORTEST_NAME = 12


def verdict_table(rows: pd.DataFrame, *, width: int | None = None) -> str:
    """The verdicts as text.

    Parameters
    ----------
    rows : DataFrame
        Of `recording_rows`, without those that failed.
    width : int or None, default=None
        Characters in a line. None: those of the terminal; without one there is no limit.

    Returns
    -------
    str
        One line for each recording. Where they do not fit, the shares of the conditions are left
        out, then ``none of these`` is ``none``, and then the names of recordings are cut at their
        front.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = pd.DataFrame({
    ...     "recording": ["a/long/path/to/run_1.npy"], "verdict": ["good"], "confidence": [0.5],
    ...     "windows": [9], "no signal": [0], "alarms": [0.25], "share of good": [1.0],
    ... })
    >>> print(verdict_table(rows, width=53))
                        verdict confidence windows alarms
    …/path/to/run_1.npy    good      50.0%       9  25.0%
    """
    if width is None:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 10**6
    shares = [name for name in rows if name.startswith("share of ")]
    first = [name for name in ("condition", "rpm") if name in rows and rows[name].notna().any()]
    first += ["verdict", "confidence", "windows", "no signal", "alarms"]
    first += [name for name in ("p-value",) if name in rows]
    table = rows.set_index("recording").rename_axis(None)[[*first, *shares]]
    if table["confidence"].isna().all():
        table = table.drop(columns="confidence")
    if not table["no signal"].any():
        table = table.drop(columns="no signal")
    for name in [*table.columns.intersection(_PERCENTAGES), *shares]:
        table[name] = table[name].map("{:.1%}".format, na_action="ignore")
    if "p-value" in table:
        rejected = rows["none of these"].fillna(False)
        table["p-value"] = [
            None if pd.isna(p) else f"{p:.2g}, none of these" if is_none else f"{p:.2g}"
            for p, is_none in zip(table["p-value"], rejected, strict=True)
        ]
    if "rpm" in table:
        table["rpm"] = table["rpm"].map("{:g}".format, na_action="ignore")
    table = table.astype(object).where(table.notna(), "-")
    if _width(table) > width:
        table = table.drop(columns=shares)
    if _width(table) > width and "p-value" in table:
        # A remark below the table says it in full.
        table["p-value"] = [text.removesuffix(" of these") for text in table["p-value"]]
    excess = _width(table) - width
    if excess > 0:
        longest = max(max(map(len, table.index)) - excess, _SHORTEST_NAME)
        table.index = [_end_of(name, longest) for name in table.index]
    return table.to_string()


def _width(table):
    return max(map(len, table.to_string().splitlines()))


def _end_of(name, longest):
    return name if len(name) <= longest else "…" + name[1 - longest :]
