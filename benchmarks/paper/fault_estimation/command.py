"""Fault estimates against the simulated rig's known fault signal: error, delay, bias.

Run ``python -m benchmarks.paper fault-estimation`` from the root of the repository.
``--write docs/paper/fault_estimation.md`` puts tables between the marks of that page
and plots into ``images`` next to it.
"""

import numpy as np

from benchmarks.blocks import markdown, page_parser, publish
from benchmarks.paper.fault_estimation import studies
from benchmarks.paper.fault_estimation.plots import trade_off, trajectories

SEEDS = (11, 12, 13, 14, 15)
N_SAMPLES = 120_000
#: Columns that identify the rows of each study's table.
ROWS = {
    "observers": ["observer"],
    "synthetic": ["fault", "observer"],
    "bearing": ["crack_mm", "condition", "observer"],
    "gains": ["kp", "ki", "observer"],
}


def parsed(arguments):
    parser = page_parser(__doc__, "fault-estimation")
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


def over_draws(frame, rows):
    """Mean over the draws, with the standard deviation where it shows.

    Parameters
    ----------
    frame : DataFrame
        With ``seed``, the columns `rows` and numbers.
    rows : list of str
        Columns that identify the rows of the table.

    Returns
    -------
    table : DataFrame
        In the order of appearance; text.
    """
    grouped = frame.drop(columns="seed").groupby(rows, sort=False)
    mean = grouped.mean()
    spread = grouped.std()
    table = mean.astype(object)
    for name in mean.columns:
        cells = zip(mean[name], spread[name], strict=True)
        table[name] = [cell(each, scatter) for each, scatter in cells]
    table = table.reset_index()
    for name in rows:
        table[name] = [
            f"{each:g}" if isinstance(each, float) else each for each in table[name]
        ]
    return table


def cell(mean, spread):
    """Format a mean: three decimals with the deviation, integers without, NaN as an empty text.

    Examples
    --------
    >>> cell(0.5, 0.0123), cell(28.0, 0.0), cell(float("nan"), 0.0), cell(-1e-5, 1e-6)
    ('0.500 ± 0.012', '28', '', '0.000')
    """
    if np.isnan(mean):
        return ""
    if float(mean).is_integer() and not spread > 0:
        return f"{mean:.0f}"
    text = f"{round(mean, 3) + 0.0:.3f}"
    return f"{text} ± {spread:.3f}" if spread >= 5e-4 else text


def main(arguments=None):
    options = parsed(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    images = (options.write.parent if options.write else options.output) / "images"
    trajectories(
        images / "fault_estimation_trajectories.svg", options.seed[0], options.n_samples
    )
    seeds = ", ".join(map(str, options.seed))
    blocks = {}
    for name, rows in ROWS.items():
        frame = getattr(studies, name)(tuple(options.seed), options.n_samples)
        frame.to_csv(options.output / f"{name}.csv", index=False)
        if name == "gains":
            trade_off(frame, images / "fault_estimation_trade_off.svg")
        blocks[f"fault estimation {name}"] = (
            "Simulated rig, 500 rpm, draws "
            f"{seeds}, recordings of {options.n_samples:,} samples; mean ± standard deviation over "
            f"the draws.\n\n{markdown(over_draws(frame, rows))}"
        )
    publish(options, blocks)
