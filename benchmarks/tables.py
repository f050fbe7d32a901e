"""Print the tables of README and docs, or recompute some of their cells.

``python -m benchmarks.tables NAME ...`` runs the commands of these tables and writes
their lines to ``docs/tables/NAME.csv``, and the blocks and pictures that are made from
these lines to the pages. ``--rig``, ``--method`` and ``--length`` select; other lines
are kept, with the date of their run.

``--check`` compares the blocks with the csv files, and recomputes at least one cell of
every method of every table, by the command that prints it. The status is 1 if a number,
a sentence, a block or a csv file differs.
"""

import argparse
import datetime
import os
import sys
import zlib
from collections.abc import Callable
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd

import skarxlag
from benchmarks import (
    another_bearing,
    comb_limits,
    cross_speed,
    detection,
    fault_orders,
    listings,
    published,
    quality,
    recorded_prior,
    reports,
    runs_to_failure,
    speed,
)
from benchmarks.blocks import ROOT, blocks_of, write_block
from benchmarks.peers import SLOW

MADE = "made"
#: Differences of two numbers that count as equal.
_ABSOLUTE = 2e-3
_RELATIVE = 2e-3
#: Columns that do not identify a line.
VALUES = frozenset(
    {
        *("rows", "right", "confidence", "stated", "stated right"),
        *("first", "score", "named", "probability", "mean log p"),
        *("below 0.01", "below 0.05", "refused", "alarm", "before", "exceed"),
        *("AUROC", "name", "since", "measured", "spread", "ours"),
        *("ball", "inner", "outer", "revolutions"),
    }
)


class Table(NamedTuple):
    """Lines of one csv file, the blocks that are made from it, and how to check it.

    Parameters
    ----------
    lines : callable
        Yields the lines. The keywords are those of the selection.
    blocks : dict of str to callable
        "page: name of the block" to a function from the lines to Markdown.
    cells : tuple of dict
        Each holds keywords with which ``--check`` recomputes some lines.
    kept : tuple of str
        Methods that a run leaves out unless they are named. Their lines are kept.
    figures : dict of str to callable
        File to a function of the lines and the path of the file.
    """

    lines: Callable
    blocks: dict
    cells: dict
    kept: tuple = ()
    figures: dict = MappingProxyType({})


_BEARING = "docs/another_bearing.md: another bearing"
_DETECTION = "docs/detection.md: detection"
TABLES = {
    "cross_speed": Table(
        cross_speed.lines,
        {
            "README.md: cross-speed overview": reports.cross_speed_overview,
            "docs/cross_speed.md: cross-speed": reports.cross_speed,
            "docs/cross_speed.md: several speeds": reports.several_speeds,
            "docs/cross_speed.md: calibration": reports.calibration,
            "docs/cross_speed.md: simulated": reports.simulated,
            "docs/stretches.md: stretches": reports.stretches,
        },
        (
            {
                "rigs": ["self-built", "simulated 3 mm"],
                "lengths": ["4800", "1 s"],
                "most_splits": 1,
            },
            *(
                {
                    "rigs": ["CWRU fan end"],
                    "lengths": ["1200"],
                    "methods": [method],
                    "most_splits": 1,
                }
                for method in SLOW
            ),
        ),
        kept=tuple(SLOW),
        figures={
            "docs/images/dots_cross_speed.svg": reports.draw_cross_speed,
            "docs/images/dots_calibration.svg": reports.draw_calibration,
        },
    ),
    "another_bearing": Table(
        another_bearing.lines,
        {
            "README.md: another bearing overview": reports.bearing_overview,
            f"{_BEARING}": reports.another_bearing,
            f"{_BEARING} locations": reports.bearing_locations,
            f"{_BEARING} probabilities": reports.bearing_probabilities,
            f"{_BEARING} variants": reports.bearing_variants,
        },
        (
            {"rigs": ["self-built"], "folds_kept": [1], "most_settings": 1},
            {
                "rigs": ["CWRU fan end"],
                "folds_kept": [-1],
                "most_settings": 1,
                "methods": another_bearing.OURS,
            },
        ),
        figures={"docs/images/dots_another_bearing.svg": reports.draw_another_bearing},
    ),
    "recorded_prior": Table(
        recorded_prior.lines,
        {f"{_BEARING} prior": reports.recorded_prior},
        ({"rigs": ["CWRU fan end"], "lengths": ["4800"]},),
    ),
    "fault_orders": Table(
        fault_orders.lines,
        {
            "docs/fault_orders.md: fault orders named": reports.orders_named,
            "docs/fault_orders.md: fault orders methods": reports.orders_methods,
        },
        (
            {"every": 9, "lengths": ["5 s"]},
            {"rigs": ["UESTC"], "every": 5, "lengths": ["whole", "1 s"]},
            *(
                {"rigs": ["MFPT"], "every": 9, "lengths": ["5 s"], "methods": [method]}
                for method in fault_orders.SLOW
            ),
        ),
        kept=tuple(fault_orders.SLOW),
    ),
    "comb_limits": Table(
        comb_limits.lines,
        {
            "docs/fault_orders.md: comb limits": comb_limits.choices,
            "docs/fault_orders.md: comb variants": comb_limits.variants,
        },
        ({"rigs": ["MFPT"], "every": 9},),
    ),
    "detection": Table(
        detection.lines,
        {
            "README.md: detection overview": reports.detection_overview,
            f"{_DETECTION}": reports.detection,
            f"{_DETECTION} families": reports.missed_families,
        },
        (
            {"rigs": ["UESTC"], "lengths": ["1 s"], "kinds": ["left out"]},
            {"rigs": ["self-built"], "lengths": ["4800"], "kinds": ["one speed"]},
        ),
    ),
    "unknown": Table(
        detection.unknown_lines,
        {"docs/detection.md: unknown": reports.unknown},
        ({"lengths": ["1 s"]},),
    ),
    "published": Table(
        published.lines,
        {
            "README.md: published": reports.published_overview,
            "docs/published.md: published": reports.published,
        },
        ({"most_runs": 1},),
    ),
    "runs_to_failure": Table(
        runs_to_failure.lines,
        {"docs/monitoring.md: runs to failure": reports.runs_to_failure},
        ({"runs": ["Bearing2_1"]},),
    ),
    "signal_quality": Table(
        quality.lines,
        {"docs/signal_quality.md: signal quality": reports.signal_quality},
        ({"rigs": ["UESTC"], "most_recordings": 1},),
    ),
    "speed": Table(
        speed.lines,
        {"benchmarks/README.md: speed": reports.speed},
        # Times differ from run to run.
        (),
        kept=tuple(speed.ROWS),
    ),
}
#: Blocks that are printed in full from the package itself.
LISTINGS = {
    "README.md: terminal example": listings.terminal_example,
    "docs/results.md: terminal example": listings.terminal_example,
    "docs/bearings.md: bearings": listings.bearings,
    "docs/recordings.md: file formats": listings.formats,
}


def csv_of(name):
    """Return the file of a table."""
    return ROOT / "docs" / "tables" / f"{name}.csv"


def read_lines(name):
    """Return the stored lines of a table, None before they were computed."""
    if not csv_of(name).exists():
        return None
    return pd.read_csv(csv_of(name), keep_default_na=False, na_values=[""])


def keys_of(lines):
    """Return the columns that identify a line."""
    return [name for name in lines.columns if name not in VALUES and name != MADE]


def block_text(name, page, make, lines):
    """Return the text of a block: what is made from the lines, and where they come from."""
    command = f"`python -m benchmarks.tables {name}`"
    if lines is None:
        return (
            f"*Not computed with this version of the package. {command} computes it.*"
        )
    is_kept = _methods(lines).isin(TABLES[name].kept)
    made = _dates(lines if is_kept.all() else lines[~is_kept])
    for method, kept in lines[is_kept].groupby(_methods(lines)):
        # Methods that a run leaves out may be of an earlier run than the others.
        if _dates(kept) != made:
            made += f"; {method}: {_dates(kept)}, not printed again since"
    link = os.path.relpath(csv_of(name), (ROOT / page).parent)
    source = f"[{len(lines)} lines of results]({link})"
    # A block shows few of the lines: the checksum is of all of them.
    checksum = zlib.crc32(csv_of(name).read_bytes())
    source += f" with the checksum {checksum:08x}"
    return f"{make(lines)}\n\n*From {source}, computed by {command}, {made}.*"


def _dates(lines):
    dates = sorted(set(lines[MADE]))
    return dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"


def print_table(name, selection):
    """Compute lines of a table, join them with those that are kept, and write everything."""
    table = TABLES[name]
    made = f"{datetime.date.today()} (version {skarxlag.__version__})"
    lines = pd.DataFrame(table.lines(**selection))
    lines[MADE] = made
    stored = read_lines(name)
    if stored is not None:
        if not selection.keys() - {"home"}:
            stored = stored[_methods(stored).isin(table.kept)]
        keys = keys_of(lines)
        stored = stored.reindex(columns=lines.columns) if stored.empty else stored
        # A line that was computed again replaces the stored one.
        both = pd.concat([stored, lines], ignore_index=True)
        lines = both[~both[keys].fillna("").astype(str).duplicated(keep="last")]
        lines = lines.sort_values(keys, key=lambda column: column.astype(str))
    lines.to_csv(csv_of(name), index=False)
    write_pages(name)


def write_pages(name):
    """Write the blocks and figures of a table from its csv file."""
    lines = read_lines(name)
    for block, make in TABLES[name].blocks.items():
        page, _, title = block.partition(": ")
        write_block(page, title, block_text(name, page, make, lines))
    for figure, draw in TABLES[name].figures.items() if lines is not None else ():
        draw(lines, ROOT / figure)


def _methods(lines):
    return lines.get("method", pd.Series("", index=lines.index))


def check_blocks(name, pages):
    """Return the blocks of a table that differ from what its csv file gives."""
    lines = read_lines(name)
    wrong = []
    for block, make in TABLES[name].blocks.items():
        page, _, title = block.partition(": ")
        if pages[page].get(title) != block_text(name, page, make, lines):
            wrong.append(f"{block} is not what {csv_of(name).name} gives")
    return wrong


def check_cells(name, home=None, cells=None):
    """Recompute some cells of a table.

    Parameters
    ----------
    name : str
        A table.
    home : path or None
        Folder of the rigs.
    cells : tuple of dict or None, default=None
        Selections in place of those of the table.

    Returns
    -------
    wrong : list of str
        What differs.
    n_compared, n_cells : int
        Cells that were compared, and all cells.
    absent : list of str
        Packages of peers that are not installed, so their cells were not computed.
    """
    table = TABLES[name]
    stored = read_lines(name)
    if stored is None:
        return [], 0, 0, []
    values = [column for column in stored if column in VALUES]
    n_cells = int(stored[values].notna().sum().sum())
    lines, absent = _selected(table, home, cells or table.cells)
    if lines.empty:
        return [], 0, n_cells, absent
    if "method" in stored and "rig" in stored:
        # A method that is not printed of a rig has no lines to compare.
        printed = set(zip(stored["rig"], stored["method"], strict=True))
        pairs = zip(lines["rig"], lines["method"], strict=True)
        lines = lines[[pair in printed for pair in pairs]]
    keys = keys_of(lines)
    # Peers without probabilities have fewer columns.
    lines = lines.reindex(columns=[*keys, *values])
    stored_lines = stored.set_index(_texts(stored, keys))
    lines = lines.set_index(_texts(lines, keys))
    wrong = [
        f"no stored line {key}" for key in lines.index.difference(stored_lines.index)
    ]
    n_compared = 0
    for key in lines.index.intersection(stored_lines.index):
        for column in values:
            now = lines[column][key]
            before = stored_lines[column][key]
            n_compared += not pd.isna(before)
            if not _is_equal(before, now):
                wrong.append(f"{key}: {column} is {now}, stored {before}")
    missing = set(_methods(stored)) - set(_methods(lines))
    missing -= set(table.kept) if absent else set()
    wrong += [f"no cell of the method {method!r} was computed" for method in missing]
    return wrong, n_compared, n_cells, absent


def _selected(table, home, cells):
    """Compute the lines of some selections, without peers that are not installed."""
    lines = []
    absent = []
    for selection in cells:
        try:
            lines += table.lines(home=home, **selection)
        except ModuleNotFoundError as error:
            # Some packages raise it with a text alone.
            absent.append(error.name or str(error))
    lines = pd.DataFrame(lines)
    return lines.drop_duplicates(keys_of(lines)), absent


def _texts(frame, keys):
    """Return a text for each line, in which 1 and 1.0 are the same, as an index."""

    def text(value):
        return f"{value:g}" if isinstance(value, (float, np.number)) else str(value)

    lines = frame[keys].fillna("").itertuples(index=False)
    return pd.Index(["; ".join(map(text, line)) for line in lines])


def _is_equal(before, now):
    if pd.isna(before) or pd.isna(now):
        return pd.isna(before) and pd.isna(now)
    if isinstance(before, str) or isinstance(now, str):
        return str(before) == str(now)
    return bool(np.isclose(before, now, rtol=_RELATIVE, atol=_ABSOLUTE))


def check(names, home=None):
    """Check tables and listings, print what was compared, and return what differs."""
    pages = {}
    for block in (
        *LISTINGS,
        *(block for table in TABLES.values() for block in table.blocks),
    ):
        page = block.partition(": ")[0]
        pages[page] = blocks_of((ROOT / page).read_text("utf-8"))
    wrong = []
    total = np.zeros(2, dtype=int)
    for name in names:
        differs = check_blocks(name, pages)
        cells, n_compared, n_cells, absent = check_cells(name, home)
        differs += cells
        total += n_compared, n_cells
        state = f"{len(differs)} differ" if differs else "equal"
        state += "".join(f", {package} is not installed" for package in absent)
        print(f"{name:22} {n_compared:6} of {n_cells:6} cells: {state}", flush=True)
        wrong += [f"{name}: {text}" for text in differs]
    for block, make in LISTINGS.items():
        page, _, title = block.partition(": ")
        text = make(home)
        if text is not None and pages[page].get(title) != text:
            wrong.append(f"{block} differs from what is printed now")
    print(f"{total[0]} of {total[1]} cells were compared")
    return wrong


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.tables",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("table", nargs="*", help=f"{', '.join(TABLES)}, listings")
    parser.add_argument("--check", action="store_true", help="recompute some cells")
    parser.add_argument("--pages", action="store_true", help="write the pages only")
    parser.add_argument("--data-home", help="folder of the rigs")
    for name in ("rig", "method", "length"):
        parser.add_argument(f"--{name}", nargs="+", help="compute these only")
    options = parser.parse_args(arguments)
    if unknown := set(options.table) - {*TABLES, "listings"}:
        parser.error(f"{sorted(unknown)}: expected names among {', '.join(TABLES)}")
    names = [name for name in options.table or TABLES if name in TABLES]
    if options.check:
        wrong = check(names, options.data_home)
        print("\n".join(wrong), file=sys.stderr)
        return int(bool(wrong))
    selection = {"home": options.data_home}
    for name in ("rig", "method", "length"):
        if getattr(options, name):
            selection[f"{name}s"] = getattr(options, name)
    for name in names:
        if options.pages:
            write_pages(name)
        else:
            print_table(name, selection)
    if not options.table or "listings" in options.table:
        for block, make in LISTINGS.items():
            page, _, title = block.partition(": ")
            text = make(options.data_home)
            if text is not None:
                write_block(page, title, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
