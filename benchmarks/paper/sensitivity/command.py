"""Effect of the choices that the paper leaves open on the accuracy, on the simulated rig.

Run ``python -m benchmarks.paper sensitivity`` from the root of the repository. Nothing
here chooses a default. ``--write docs/paper/sensitivity.md`` puts the tables between
the marks of that page and the plots into the folder ``images`` next to it.
"""

from functools import partial
from inspect import getdoc
from typing import NamedTuple

from benchmarks.pages.blocks import page_parser, publish
from benchmarks.paper.sensitivity import studies
from benchmarks.paper.sensitivity.compound import compound
from benchmarks.paper.sensitivity.gains import gains
from benchmarks.paper.sensitivity.plots import bars, gain_maps, lines, verdict_shares
from benchmarks.paper.sensitivity.protocol import N_SAMPLES, SEEDS
from benchmarks.paper.sensitivity.tables import (
    accuracy_table,
    compound_table,
    crack_table,
    gains_table,
    noise_table,
)


class Study(NamedTuple):
    """Functions of one study: computation, table and plot."""

    run: callable
    table: callable
    plot: callable


STUDIES = {
    "noise": Study(
        studies.noise,
        noise_table,
        partial(lines, x="noise (mV)", scale="log", split="calibrated with"),
    ),
    "window length": Study(
        studies.window_length,
        partial(
            accuracy_table,
            rows=["window length", "ms", "windows to calibrate a condition"],
        ),
        partial(lines, x="window length", scale="log"),
    ),
    "order": Study(
        studies.order,
        partial(accuracy_table, rows=["order"]),
        partial(lines, x="order", scale="log"),
    ),
    "pole": Study(
        studies.pole, partial(accuracy_table, rows=["pole"]), partial(lines, x="pole")
    ),
    "gains": Study(gains, gains_table, gain_maps),
    "speed": Study(
        studies.speed,
        partial(accuracy_table, rows=["calibrated at", "rpm"]),
        partial(lines, x="rpm", split="calibrated at"),
    ),
    "crack size": Study(
        studies.crack_size,
        crack_table,
        partial(
            bars,
            panel="tested at",
            group=["calibrated on", "tested on"],
            label="calibrated on, tested on",
        ),
    ),
    "compound": Study(compound, compound_table, verdict_shares),
    "torque": Study(
        studies.torque,
        partial(accuracy_table, rows=["measured"]),
        partial(bars, panel="crack size", group=["measured"], label="measured"),
    ),
}


def parsed(arguments):
    parser = page_parser(__doc__, "sensitivity")
    parser.add_argument("--only", nargs="+", choices=STUDIES, default=list(STUDIES))
    parser.add_argument(
        "--seed", nargs="+", type=int, default=list(SEEDS), help="draws of the rig"
    )
    parser.add_argument(
        "--n-samples",
        type=int,
        default=N_SAMPLES,
        help=f"of a recording; default: {N_SAMPLES}",
    )
    return parser.parse_args(arguments)


def protocol(options):
    """Describe the protocol that all studies share."""
    seeds = ", ".join(map(str, options.seed))
    return (
        f"Simulated rig, draws {seeds} (`random_state`), recordings of {options.n_samples:,} "
        "samples (the paper: 120,000). Unless a table states otherwise, all windows of 1200 "
        "samples at 500 rpm calibrate, all windows at 300, 400 and 450 rpm are scored, one crack "
        "size at a time with the normal windows. Accuracy of single windows in %, mean ± standard "
        "deviation over the draws. Chance is 12.5."
    )


def main(arguments=None):
    options = parsed(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    images = (options.write.parent if options.write else options.output) / "images"
    blocks = {"sensitivity protocol": protocol(options)}
    for name in options.only:
        study = STUDIES[name]
        stem = name.replace(" ", "_")
        frame = study.run(tuple(options.seed), options.n_samples)
        frame.to_csv(options.output / f"{stem}.csv", index=False)
        study.plot(frame, images / f"sensitivity_{stem}.svg")
        about = getdoc(study.run).splitlines()[0]
        blocks[f"sensitivity {name}"] = f"{about}\n\n{study.table(frame)}"
    publish(options, blocks)
