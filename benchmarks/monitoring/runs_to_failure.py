"""When the monitor's alarm goes on in runs of a bearing from healthy to failed.

    python -m benchmarks.monitoring --data-home FOLDER --write docs/monitoring.md

FOLDER/femto holds one ``.npz`` file of snapshots for each run: ``acceleration_g`` of
shape (n_snapshots, n_channels, n_samples), their times ``seconds``, ``rpm`` and
``sampling_rate``. They are not downloaded. The first tenth of a run is taken for
healthy: the detector is fitted on it. The rest goes through `ConditionMonitor` as it
came.
"""

import argparse
import warnings
from itertools import cycle
from pathlib import Path

import numpy as np
import pandas as pd
from sklearn.datasets import get_data_home

from benchmarks.pages.blocks import markdown, write_blocks
from benchmarks.pages.svg_figures import BLUE, ORANGE, legend_below, saved_figure
from skarxlag import ConditionMonitor, make_detector

HEALTHY_SHARE = 0.1
#: The lowest rate that about 20 healthy snapshots support, as a round number.
FALSE_ALARM_RATE = 0.05
#: Hours of signal. With a tenth of a second in ten seconds, 100 hours of a run.
FALSE_ALARM_INTERVAL = 1.0
#: Numbers of healthy snapshots that the detector is fitted on, one after the other.
FEW_HEALTHY = (2, 3, 4, 5, 6, 8, 10, 12)


def watch_run(snapshots, seconds, rpm, sampling_rate, most_healthy=None):
    """Return the verdicts of the monitor on one channel of a run, after its healthy part.

    Parameters
    ----------
    snapshots : ndarray of shape (n_snapshots, n_samples)
        Short parts of the signal.
    seconds : ndarray of shape (n_snapshots,)
        When each began.
    rpm : float
        Nominal speed.
    sampling_rate : float
        In Hz.
    most_healthy : int or None, default=None
        Number of snapshots of the healthy part that the detector is fitted on; None for
        all. The rest of the healthy part is not used.

    Returns
    -------
    verdicts : list of MonitorVerdict
        One for each snapshot.
    n_healthy : int
        Snapshots that the detector was fitted on.
    """
    healthy = seconds < HEALTHY_SHARE * seconds[-1]
    detector = make_detector(false_alarm_rate=FALSE_ALARM_RATE, fixed_gain=True)
    with warnings.catch_warnings():
        # A run has one speed and few healthy snapshots; the page states this.
        warnings.simplefilter("ignore", UserWarning)
        detector.fit(snapshots[healthy][:most_healthy], rpm=rpm)
    monitor = ConditionMonitor(
        None,
        sampling_rate,
        detector=detector,
        window_length=snapshots.shape[1],
        false_alarm_interval=FALSE_ALARM_INTERVAL,
    )
    verdicts = updated(monitor, snapshots[~healthy], seconds[~healthy], rpm)
    return verdicts, len(snapshots[healthy][:most_healthy])


def updated(monitor, snapshots, seconds, rpm):
    """Return the verdicts of a monitor on snapshots, which it gets one by one."""
    verdicts = []
    for snapshot, start in zip(snapshots, seconds, strict=True):
        verdicts += monitor.update(snapshot, time=float(start), rpm=rpm)
    return verdicts


def alarm_row(verdicts, end):
    """Return the time of the last alarm before the end of a run, and the earlier alarms.

    Parameters
    ----------
    verdicts : list of MonitorVerdict
        Of one run.
    end : float
        Seconds at which the run ended.

    Returns
    -------
    dict
        A row of the table. "Before" counts alarms that went off again.
    """
    alarm = np.array([verdict.alarm for verdict in verdicts])
    time = np.array([verdict.time for verdict in verdicts])
    exceeds = np.array([bool(verdict.exceeds) for verdict in verdicts])
    on = np.flatnonzero(np.diff(alarm.astype(int), prepend=0) == 1)
    is_on_at_end = len(on) > 0 and alarm[-1]
    last = on[-1] if is_on_at_end else len(alarm)
    return {
        "alarm, s": f"{time[last]:.0f}" if is_on_at_end else "none",
        "before the end, s": f"{end - time[last]:.0f}" if is_on_at_end else "",
        "share of the run": f"{time[last] / end:.2f}" if is_on_at_end else "",
        "alarms before, that went off": len(on) - is_on_at_end,
        "snapshots that exceed before": f"{exceeds[:last].mean():.2f}",
    }


def few_healthy_table(runs):
    """Tabulate the alarms of detectors that were fitted on few healthy snapshots.

    Parameters
    ----------
    runs : list of tuple
        As `read_runs` yields them.

    Returns
    -------
    DataFrame
        A row for each number of snapshots.
    """
    rows = []
    for n_healthy in FEW_HEALTHY:
        of_channels = [
            alarm_row(watch_run(channel, seconds, rpm, rate, n_healthy)[0], seconds[-1])
            for _, signal, seconds, rpm, rate in runs
            for channel in signal.swapaxes(0, 1)
        ]
        alarms = pd.DataFrame(of_channels)
        at_end = alarms[alarms["alarm, s"] != "none"]
        rows.append(
            {
                "healthy snapshots": n_healthy,
                "channels": len(alarms),
                "with an alarm at the end": len(at_end),
                "earliest, share of the run": min(
                    at_end["share of the run"], default=""
                ),
                "latest, share of the run": max(at_end["share of the run"], default=""),
                "alarms before, that went off": alarms[
                    "alarms before, that went off"
                ].sum(),
            }
        )
    return pd.DataFrame(rows)


def draw(runs, path):
    """Level of the alarm over each run, one line for each channel."""
    with saved_figure(
        path, len(runs), size=(7.0, 1.5 * len(runs) + 0.5), sharey=True
    ) as axes:
        for ax, (name, channels) in zip(axes[:, 0], runs.items(), strict=True):
            for number, (verdicts, colour) in enumerate(
                zip(channels, cycle([BLUE, ORANGE]), strict=False)
            ):
                time = [verdict.time for verdict in verdicts]
                level = [verdict.alarm_level for verdict in verdicts]
                ax.plot(time, level, color=colour, label=f"channel {number}")
            ax.set(ylim=(-0.05, 1.05), ylabel="alarm level", title=name)
        axes[-1, 0].set_xlabel("seconds since the start of the run")
        legend_below(axes)


def read_runs(data_home, paths=()):
    """Yield name, signal, times of its snapshots, speed and sampling rate of each run.

    Parameters
    ----------
    data_home : str or None
        Folder of the real rigs.
    paths : list of Path
        Files of the runs; none for all.
    """
    folder = Path(get_data_home(data_home)) / "femto"
    for path in paths or sorted(folder.glob("*.npz")):
        with np.load(path) as file:
            signal = file["acceleration_g"].astype(float)
            seconds = file["seconds"]
            yield (
                path.stem,
                signal,
                seconds,
                float(file["rpm"]),
                float(file["sampling_rate"]),
            )


def main(arguments=None):
    """Watch runs, print the table, write and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN.npz",
        help="default: all of FOLDER/femto",
    )
    parser.add_argument("--data-home", metavar="FOLDER", help="default: scikit-learn's")
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file for the table"
    )
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="where to draw the alarm levels"
    )
    options = parser.parse_args(arguments)
    rows = []
    runs = {}
    recorded = list(read_runs(options.data_home, options.runs))
    for name, signal, seconds, rpm, sampling_rate in recorded:
        end = seconds[-1] + signal.shape[2] / sampling_rate
        for channel in range(signal.shape[1]):
            verdicts, n_healthy = watch_run(
                signal[:, channel], seconds, rpm, sampling_rate
            )
            runs.setdefault(name, []).append(verdicts)
            row = {"run": name, "channel": channel, "healthy snapshots": n_healthy}
            rows.append(row | alarm_row(verdicts, end))
    blocks = {
        "runs to failure": markdown(pd.DataFrame(rows)),
        "few healthy snapshots": markdown(few_healthy_table(recorded)),
    }
    print("\n\n".join(blocks.values()))
    if options.figure:
        draw(runs, options.figure)
    if options.write:
        write_blocks(options.write, blocks)
