"""Tables 2-9 of the paper on the simulated rig, in four runs, for a page of the documentation.

Under the protocol of ``python -m skarxlag evaluate``: with a bank of residuals, with
the paper's single residual, with windows of several impacts of a defect, and with
stretches.
"""

import sys
from functools import partial
from time import perf_counter

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from benchmarks.blocks import markdown, page_parser, publish
from benchmarks.paper.ladders import DIAGNOSERS, LADDERS, SINGLE_OBSERVER
from benchmarks.paper.printed_tables import load_tables
from benchmarks.paper.protocol import run_protocol
from benchmarks.paper.report import paper_report
from benchmarks.paper.tables_plot import averages_figure
from skarxlag import make_alpio, make_diagnoser
from skarxlag.bearings import SKF_6205, defect_frequencies
from skarxlag.datasets import simulate_rig
from skarxlag.datasets.rig import LOCATIONS

PAPER = load_tables().claims
PAPER_WINDOW = PAPER["samples_per_window"]
PAPER_SAMPLES = PAPER["samples_per_condition"]
IMPACTS = 3
LONG_WINDOWS = 20
#: Stretches of a recording, and their length in seconds.
STRETCHES = 4
STRETCH_SECONDS = 1.0
#: Runs with tables on the page.
SHOWN = ("bank", "single residual", "long windows", "stretches")
#: Tables of which the page compares the runs.
COMPARED = ("averages", "improvements")
#: Those that have the cells of Tables 2-5 in another order.
REORDERED = ("table8", "table9")


def make_single_observer_pio(**pipeline):
    """Make the paper's proposal with one observer, as the printed equations suggest.

    One extended-state observer receives the innovations of each condition's model. Its
    sliding-mode gain, which settles at a median over the whole window, is the residual
    of that condition.
    """
    return make_alpio(**pipeline).set_params(observe=SINGLE_OBSERVER())


def window_of_impacts(n_impacts):
    """Return the samples in which the slowest defect at the lowest speed has this many impacts.

    Rounded up to a multiple of the paper's window.

    Examples
    --------
    >>> window_of_impacts(3)
    42000
    """
    lowest = min(load_tables().tables[number].rpm for number in (2, 3, 4, 5))
    slowest = min(
        defect_frequencies(SKF_6205, lowest)[location] for location in LOCATIONS
    )
    samples = n_impacts * PAPER["sampling_rate_hz"] / slowest
    return int(np.ceil(samples / PAPER_WINDOW)) * PAPER_WINDOW


def simulated(window_length, n_samples):
    """Return a function from crack size and speed to a simulated rig, for ``run_protocol``."""
    return partial(_simulate, window_length=window_length, n_samples=n_samples)


def _simulate(crack_mm, rpm, **options):
    return simulate_rig(crack_mm=crack_mm, rpm=rpm, **options)


def relative_to_healthy(load):
    """Return a loader whose output has the unit of its healthy level at that speed."""

    def scaled(crack_mm, rpm):
        rig = load(crack_mm, rpm)
        healthy = rig.data[rig.target == rig.target_names[0], 0]
        data = rig.data.copy()
        data[:, 0] /= np.sqrt(np.mean(healthy**2))
        return Bunch(**(dict(rig) | {"data": data}))

    return scaled


def with_parameters(makers, **parameters):
    """Return the diagnosers with other parameters."""
    return {
        title: lambda healthy, make=make: make(healthy=healthy).set_params(**parameters)
        for title, make in makers.items()
    }


def stretch_diagnoser(healthy):
    """The diagnoser of stretches for the sampling rate of the simulated rig."""
    return make_diagnoser(sampling_rate=PAPER["sampling_rate_hz"], healthy=healthy)


def runs(
    window_length, n_samples, long_length, long_samples, stretch_length, stretch_samples
):
    """Rig and diagnosers of each run.

    Parameters
    ----------
    window_length, n_samples : int
        Of a window and a recording in the first two runs.
    long_length, long_samples : int
        In the third.
    stretch_length, stretch_samples : int
        Of a stretch and a recording in the fourth.

    Returns
    -------
    dict of str to (callable, dict)
        What ``run_protocol`` takes. The runs of `SHOWN` come first, the others are
        variants of the first two. In the run of stretches "Diagnoser" is
        `make_diagnoser`.
    """
    bank = LADDERS["bank"]
    single = LADDERS["single"]
    observers = dict(zip(single, (make_alpio, make_single_observer_pio), strict=True))
    load = simulated(window_length, n_samples)
    title, _ = DIAGNOSERS["diagnoser"]
    return {
        "bank": (load, bank),
        "single residual": (load, single),
        "long windows": (simulated(long_length, long_samples), bank),
        "stretches": (
            simulated(stretch_length, stretch_samples),
            bank | {title: stretch_diagnoser},
        ),
        "bank, one observer": (load, observers),
        "bank, all by power": (
            load,
            with_parameters(observers, observe__evaluation="power"),
        ),
        "single residual, healthy level of each speed": (
            relative_to_healthy(load),
            single,
        ),
        "single residual, unit windows": (
            load,
            with_parameters(single, identify__unit_rms=True),
        ),
    }


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


def blocks(reports, sizes, comparison):
    """Return the Markdown blocks of the page by name: one for each run, and the comparison.

    Parameters
    ----------
    reports : dict of str to list of Table
        Tables of each run.
    sizes : dict of str to str
        Number and length of the windows of each run.
    comparison : dict of str to (str, DataFrame)
        Result of `compared`.
    """
    parts = []
    for title, cells in comparison.values():
        parts += [f"**{title}**", table_text(cells)]
    named = {"paper tables compared": "\n\n".join(parts)}
    for number, run in enumerate(SHOWN):
        parts = [f"Simulated rig, {sizes[run]}."]
        parts += [folded(table, with_paper=number == 0) for table in reports[run]]
        named[f"paper tables {run}"] = "\n\n".join(filter(None, parts))
    return named


def folded(table, *, with_paper):
    """Format a table that opens at a click; return an empty text if it would repeat another.

    Averages and improvements of all runs stand together on the page. Tables 8 and 9 are
    left out, as they are Tables 2-5 in another order. The figures of the paper are next
    to the first run.
    """
    if table.stem in (*COMPARED, *REORDERED):
        return ""
    parts = [f"<details>\n<summary>{table.title}</summary>"]
    for caption, cells in table.blocks:
        if not with_paper:
            if caption.startswith("paper"):
                continue
            cells = cells[[name for name in cells if name[0] != "paper"]]
            cells = cells[(cells != "").any(axis=1)]
        parts += [caption] if caption else []
        parts.append(table_text(cells))
    return "\n\n".join([*parts, "</details>"])


def _size(verdicts):
    counts = verdicts.groupby(["diagnoser", "crack_mm", "recording"]).size().unique()
    length = int(np.diff(np.unique(verdicts["start"]))[0])
    return f"{counts.item()} windows of {length} samples for each condition and speed"


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "paper-tables")
    options = parser.parse_args(arguments)
    long_length = window_of_impacts(IMPACTS)
    options.output.mkdir(parents=True, exist_ok=True)
    reports = {}
    sizes = {}
    stretch_length = int(STRETCH_SECONDS * PAPER["sampling_rate_hz"])
    lengths = (
        *(PAPER_WINDOW, PAPER_SAMPLES),
        *(long_length, LONG_WINDOWS * long_length),
        *(stretch_length, STRETCHES * stretch_length),
    )
    for run, (load, makers) in runs(*lengths).items():
        started = perf_counter()
        print(run, file=sys.stderr)
        outcome = run_protocol(load, makers, progress=_progress)
        reports[run] = paper_report(outcome)
        sizes[run] = _size(outcome.verdicts)
        print(f"{perf_counter() - started:.0f} s", file=sys.stderr)
        stem = run.replace(", ", "_").replace(" ", "-")
        for table in reports[run]:
            table.frame.to_csv(
                options.output / f"{stem}_{table.stem}.csv", float_format="%.6g"
            )
    comparison = compared(reports)
    _, averages = comparison["averages"]
    images = (options.write.parent if options.write else options.output) / "images"
    averages_figure(averages, images / "tables_averages.svg")
    publish(options, blocks(reports, sizes, comparison))


def _progress(text):
    print(text, end="", file=sys.stderr, flush=True)
