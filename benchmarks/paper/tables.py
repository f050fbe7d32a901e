"""Tables 2-9 of the paper on the simulated rig, for a page of the documentation.

Under the protocol of the paper: with the three typed steps, with one observer for each
model, and with one observer, one residual and one ladder.
"""

import sys
from functools import partial
from time import perf_counter

import numpy as np
import pandas as pd

from benchmarks.cross_speed.peers import make_single_observer_pio
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.paper.ladders import LADDERS
from benchmarks.paper.printed_tables import load_tables
from benchmarks.paper.protocol import run_protocol
from benchmarks.paper.report import paper_report
from benchmarks.paper.tables_plot import averages_figure
from skarxlag import make_alpio
from skarxlag.datasets import simulate_rig

PAPER = load_tables().claims
PAPER_WINDOW = PAPER["samples_per_window"]
PAPER_SAMPLES = PAPER["samples_per_condition"]
#: The run whose tables are on the page.
SHOWN = "as typed"
#: Tables of which the page compares the runs.
COMPARED = ("averages", "improvements")


def runs():
    """Return the diagnosers of each run, as ``run_protocol`` takes them."""
    single = LADDERS["single"]
    observers = dict(zip(single, (make_alpio, make_single_observer_pio), strict=True))
    return {SHOWN: LADDERS["bank"], "one observer": observers, "one ladder": single}


def compared(reports):
    """Return the averages and improvements of all runs below those of the paper.

    Parameters
    ----------
    reports : dict of str to list of Table
        Tables of each run.

    Returns
    -------
    dict of str to (str, DataFrame)
        Title and cells by the stem of the table. Rows are named by their source (for the
        simulated rig with the run) and by what they average.
    """
    by_stem = {}
    for stem in COMPARED:
        rows = {}
        for run, tables in reports.items():
            table = next(each for each in tables if each.stem == stem)
            ((_, cells),) = table.blocks
            by_source = cells.set_axis(
                pd.MultiIndex.from_tuples(name.split(", ", 1) for name in cells.index)
            )
            rows["paper"] = by_source.loc["paper"]
            rows[f"simulated rig, {run}"] = by_source.loc["simulated rig"]
        frame = pd.concat(rows, names=["source", "from"]).fillna("")
        columns = max((cells.columns for cells in rows.values()), key=len)
        by_stem[stem] = table.title, frame[columns]
    return by_stem


def table_text(cells):
    """Return the Markdown of cells under heads of one or more levels, the index in front."""
    heads = [list(key) if isinstance(key, tuple) else [key] for key in cells.columns]
    for head in heads:
        if head[0] in ("paper", "simulated rig"):
            head[0] = "paper:" if head[0] == "paper" else ""
    flat = cells.set_axis([" ".join(filter(None, head)) for head in heads], axis=1)
    return markdown(
        flat.rename_axis(
            cells.index.names if cells.index.nlevels > 1 else ""
        ).reset_index()
    )


def blocks(tables, size, comparison):
    """Return the Markdown blocks of the page by name: the comparison, and the tables of a run.

    Parameters
    ----------
    tables : list of Table
        Tables of the run `SHOWN`.
    size : str
        Number and length of its windows.
    comparison : dict of str to (str, DataFrame)
        Result of `compared`.
    """
    parts = []
    for title, cells in comparison.values():
        parts += [f"**{title}**", table_text(cells)]
    shown = [f"Simulated rig, {size}."]
    for table in tables:
        if table.stem not in COMPARED:
            shown.append(f"**{table.title}**")
            for caption, cells in table.blocks:
                shown += [*filter(None, [caption]), table_text(cells)]
    names = ("paper tables compared", f"paper tables {SHOWN}")
    return dict(zip(names, ("\n\n".join(parts), "\n\n".join(shown)), strict=True))


def _size(verdicts):
    counts = verdicts.groupby(["diagnoser", "crack_mm", "recording"]).size().unique()
    length = int(np.diff(np.unique(verdicts["start"]))[0])
    return f"{counts.item()} windows of {length} samples for each condition and speed"


def main(arguments=None):
    """Run the command."""
    options = page_parser(__doc__, "paper-tables").parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    load = partial(_simulate, window_length=PAPER_WINDOW, n_samples=PAPER_SAMPLES)
    reports = {}
    sizes = {}
    for run, makers in runs().items():
        started = perf_counter()
        print(run, file=sys.stderr)
        outcome = run_protocol(load, makers, progress=_progress)
        reports[run] = paper_report(outcome)
        sizes[run] = _size(outcome.verdicts)
        print(f"{perf_counter() - started:.0f} s", file=sys.stderr)
        stem = run.replace(" ", "-")
        for table in reports[run]:
            table.frame.to_csv(
                options.output / f"{stem}_{table.stem}.csv", float_format="%.6g"
            )
    comparison = compared(reports)
    _, averages = comparison["averages"]
    images = (options.write.parent if options.write else options.output) / "images"
    averages_figure(averages, images / "tables_averages.svg")
    publish(options, blocks(reports[SHOWN], sizes[SHOWN], comparison))


def _simulate(crack_mm, rpm, **options):
    return simulate_rig(crack_mm=crack_mm, rpm=rpm, **options)


def _progress(text):
    print(text, end="", file=sys.stderr, flush=True)
