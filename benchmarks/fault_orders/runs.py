"""When a race is named in runs of a bearing from healthy to failed, and whether the name stays.

    python -m benchmarks.fault_orders runs --data-home FOLDER --write
    docs/fault_orders.md

The runs are those of ``python -m benchmarks.monitoring``. Their snapshots of a tenth of
a second hold 2.5 to 3 revolutions of the shaft. The first tenth of a run is taken for
healthy; the rest goes through `ConditionMonitor`, which gathers the combs of the
snapshots.
"""

import numpy as np
import pandas as pd

from benchmarks.monitoring.runs_to_failure import HEALTHY_SHARE, read_runs, updated
from benchmarks.pages.blocks import markdown, page_parser, publish
from skarxlag import BearingGeometry, ConditionMonitor, make_diagnoser
from skarxlag.core.fault_locations import HEALTHY

BEARING = BearingGeometry(n_elements=13, element_diameter=3.5, pitch_diameter=25.6)
#: Seconds.
HALF_LIFE = 100.0


def names_over_time(snapshots, seconds, rpm, sampling_rate):
    """Return the verdicts of a monitor that gathers combs; arguments as of `watch_run`."""
    healthy = seconds < HEALTHY_SHARE * seconds[-1]
    diagnoser = make_diagnoser(bearing=BEARING, sampling_rate=sampling_rate)
    diagnoser.fit(snapshots[healthy], np.full(healthy.sum(), HEALTHY), rpm=rpm)
    monitor = ConditionMonitor(
        diagnoser, sampling_rate, window_length=snapshots.shape[1], half_life=HALF_LIFE
    )
    return updated(monitor, snapshots[~healthy], seconds[~healthy], rpm)


def name_row(verdicts, end):
    """When the last name was given for good, against the end, and what came before.

    Parameters
    ----------
    verdicts : list of MonitorVerdict
        Of one run.
    end : float
        Seconds at which the run ended.

    Returns
    -------
    dict
        A row of the table.
    """
    names = np.array([str(verdict.verdict) for verdict in verdicts])
    single = np.array([str(verdict.window_verdict) for verdict in verdicts])
    others = np.flatnonzero(names != names[-1])
    first = others[-1] + 1 if len(others) > 0 else 0
    if names[-1] == HEALTHY:
        first = len(names)
    row = {
        "snapshots": len(names),
        "named one by one": f"{np.mean(single[:first] != HEALTHY):.2f}",
        "named before, gathered": f"{np.mean(names[:first] != HEALTHY):.2f}",
    }
    if names[-1] == HEALTHY:
        return row | {"name that stays": "none"}
    return row | {
        "name that stays": names[-1],
        "from, s": f"{verdicts[first].time:.0f}",
        "before the end, s": f"{end - verdicts[first].time:.0f}",
        "probability at the end": f"{verdicts[-1].probability:.2f}",
        "the same one by one": f"{np.mean(single[first:] == names[-1]):.2f}",
    }


def main(arguments=None):
    """Watch runs, print the table and write it."""
    parser = page_parser(__doc__, "fault_orders_runs")
    parser.add_argument("--data-home", metavar="FOLDER", help="default: scikit-learn's")
    options = parser.parse_args(arguments)
    rows = []
    for name, signal, seconds, rpm, sampling_rate in read_runs(options.data_home):
        end = seconds[-1] + signal.shape[2] / sampling_rate
        for channel in range(signal.shape[1]):
            verdicts = names_over_time(signal[:, channel], seconds, rpm, sampling_rate)
            rows.append({"run": name, "channel": channel} | name_row(verdicts, end))
    table = pd.DataFrame(rows).fillna("")
    publish(options, {"fault orders runs": markdown(table)})
