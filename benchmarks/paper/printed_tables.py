"""Tables 2-9 of Piltan and Kim (2019) as data frames."""

import json
from functools import cache
from pathlib import Path

import pandas as pd
from sklearn.utils import Bunch


def load_tables() -> Bunch:
    """Return Tables 2-9 of the paper, and the paper's claims about them, as printed.

    Nothing is corrected: averages and margins are the printed ones, even if they are
    wrong.

    Returns
    -------
    Bunch
        - ``tables``: dict from the number of a table to a Bunch with ``caption``,
          ``frame`` and the ``rpm`` and ``crack_mm`` that it is about, None where these
          head its columns. Values are percent.

          Of Tables 2-5 (one speed) and 8-9 (one crack size), ``frame`` has a row for
          each condition and columns ``(method, crack_mm)`` or ``(method, rpm)`` with
          the methods "proposed" and "ALPIO"; ``average`` is the printed last row.

          Of the confusion matrices, Tables 6-7, ``frame`` has true conditions as rows
          and verdicts as columns, though the paper labels them the other way round: its
          rows, not its columns, sum to 100 windows. ``right_margin``, ``bottom_margin``
          and ``accuracy`` are printed; ``right_label`` and ``bottom_label`` are what
          the paper calls the margins.
        - ``claims``: dict of the numbers in abstract, text and conclusion.
        - ``source``: the reference.

    References
    ----------
    F. Piltan and J.-M. Kim (2019), "Nonlinear Extended-state ARX-Laguerre PI Observer
    Fault Diagnosis of Bearings", Applied Sciences 9(5), 888, doi:10.3390/app9050888.

    Examples
    --------
    >>> from benchmarks.paper.printed_tables import load_tables
    >>> table = load_tables().tables[5]
    >>> table.rpm, table.frame.loc["Ball", ("proposed", 3)].item()
    (500, 97.0)
    >>> table.average["proposed", 3].item(), table.frame["proposed", 3].mean().item()
    (99.9, 97.75)
    """
    content = _read()
    tables = {
        int(each["id"].removeprefix("table")): _table(each)
        for each in content["tables"]
    }
    return Bunch(
        tables=tables, claims=dict(content["claims"]), source=content["source"]
    )


@cache
def _read():
    return json.loads(
        Path(__file__).with_name("printed_tables.json").read_text(encoding="utf-8")
    )


def _table(content):
    about = {name: content.get(name) for name in ("caption", "rpm", "crack_mm")}
    if content["kind"] == "accuracy":
        columns = pd.MultiIndex.from_tuples(
            [
                (method, float(value))
                for method, value in map(dict.values, content["columns"])
            ],
            names=list(content["columns"][0]),
        )
        index = pd.Index(content["rows"], name="condition")
        return Bunch(
            frame=pd.DataFrame(content["values"], index, columns, dtype=float),
            average=pd.Series(content["printed_average"], columns, dtype=float),
            **about,
        )
    names = content["classes"]
    right, bottom = (content[f"printed_{side}_margin"] for side in ("right", "bottom"))
    return Bunch(
        frame=pd.DataFrame(
            content["values"],
            pd.Index(names, name="true"),
            pd.Index(names, name="predicted"),
            dtype=float,
        ),
        right_margin=pd.Series(right["values"], names, dtype=float),
        right_label=right["label"],
        bottom_margin=pd.Series(bottom["values"], names, dtype=float),
        bottom_label=bottom["label"],
        accuracy=content["printed_overall"],
        **about,
    )
