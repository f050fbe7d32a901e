"""Three real runs to failure: when does a detector of healthy recordings raise an alarm?

Run ``python -m benchmarks.detection runs --data-home FOLDER`` from the root of the
repository. FOLDER/femto holds one .npz for each run of the PRONOSTIA test bench
(learning set of the IEEE PHM 2012 challenge): ``acceleration_g`` (n, 2, 2560),
``seconds`` since the start, ``rpm``. They are not downloaded. The onset of a fault is
unknown, so times are given before the end of the run.
"""

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
from sklearn.datasets import get_data_home

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.pages.svg_figures import BLUE, GREY, ORANGE, legend_below, saved_figure
from skarxlag import make_detector

#: Approximately the lowest rate that the 13 to 23 rows of a first tenth support.
RATE = 0.05
#: Share of a run's time that is taken for healthy.
HEALTHY = 0.1
#: An alarm of the machine: this many of that many snapshots in a row are flagged.
SOME = 3
OF = 5


def load_run(path):
    """Rows, times in seconds and speed of one run; rows are snapshots of the horizontal axis."""
    with np.load(path) as run:
        return (
            run["acceleration_g"][:, 0].astype(float),
            run["seconds"],
            float(run["rpm"]),
        )


def first_alarm(flagged):
    """Return the first row at which enough of the last rows are flagged; None for none."""
    recent = np.convolve(flagged, np.ones(OF), mode="full")[: len(flagged)]
    rows = np.flatnonzero(recent > SOME - 0.5)
    return int(rows[0]) if len(rows) else None


def calibrated(run, fixed_gain):
    """Detector of the healthy start of a run."""
    X, seconds, rpm = run
    detector = make_detector(false_alarm_rate=RATE, fixed_gain=fixed_gain)
    return detector.fit(X[seconds <= HEALTHY * seconds[-1]], rpm=rpm)


def alarm_times(runs, fixed_gain):
    """Return one row for each run and bearing; the healthy start calibrates the detector."""
    rows = []
    for calibration, run in runs.items():
        with warnings.catch_warnings():
            # One speed and few rows: the table states both.
            warnings.simplefilter("ignore", UserWarning)
            detector = calibrated(run, fixed_gain)
            for name, (snapshots, times, speed) in runs.items():
                flagged = detector.predict(snapshots, rpm=speed) < 0
                start = times <= HEALTHY * times[-1]
                # The rows of the calibration cannot show alarms.
                counted = flagged & ~start if name == calibration else flagged
                row = first_alarm(counted)
                rows.append(
                    {
                        "run": name,
                        "rpm": speed,
                        "calibrated on": "itself"
                        if name == calibration
                        else calibration,
                        "healthy rows": detector[-1].n_rows_,
                        "level counts": "yes" if fixed_gain else "no",
                        "flagged in its first tenth, %": 100 * flagged[start].mean(),
                        "first alarm, minutes before the end": np.nan
                        if row is None
                        else (times[-1] - times[row]) / 60,
                        "at share of the run": np.nan
                        if row is None
                        else times[row] / times[-1],
                        "flagged in its last ten minutes, %": 100
                        * flagged[times > times[-1] - 600].mean(),
                    }
                )
    return pd.DataFrame(rows).sort_values(["run", "level counts"], kind="stable")


def draw(runs, path):
    """Draw the p-values over each run and the first alarms."""
    kinds = {False: (BLUE, "without the level"), True: (ORANGE, "with the level")}
    with saved_figure(
        path, len(runs), size=(7.0, 1.6 * len(runs) + 0.6), sharey=True
    ) as axes:
        for ax, (name, run) in zip(axes[:, 0], runs.items(), strict=True):
            X, seconds, rpm = run
            left = (seconds[-1] - seconds) / 60
            start = seconds <= HEALTHY * seconds[-1]
            ax.axvspan(left[0], left[start][-1], color=GREY, alpha=0.2, lw=0)
            ax.axhline(RATE, color=GREY, linestyle=":")
            for fixed_gain, (colour, label) in kinds.items():
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)
                    p_values = calibrated(run, fixed_gain).p_values(X, rpm=rpm)
                ax.plot(left, p_values, color=colour, linewidth=0.8, label=label)
                row = first_alarm((p_values < RATE) & ~start)
                if row is not None:
                    ax.axvline(left[row], color=colour, linestyle="--", linewidth=1)
            ax.set(
                yscale="log",
                title=f"{name}, {rpm:g} rpm",
                xlim=(left[0], 0),
                ylabel="p-value",
            )
        axes[-1, 0].set_xlabel("minutes before the end of the run")
        legend_below(axes)


def main(arguments=None):
    parser = page_parser(__doc__, "detection-runs")
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="where to draw the p-values"
    )
    parser.add_argument("--data-home", help="folder that holds femto")
    chosen = parser.parse_args(arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    folder = Path(get_data_home(chosen.data_home)) / "femto"
    runs = {path.stem: load_run(path) for path in sorted(folder.glob("*.npz"))}
    alarms = pd.concat([alarm_times(runs, fixed_gain) for fixed_gain in (False, True)])
    alarms = alarms.sort_values(["run", "level counts"], kind="stable")
    alarms.to_csv(chosen.output / "runs.csv", index=False)
    text = (
        "Runs to failure of the PRONOSTIA test "
        f"bench; stated rate {RATE:.0%}, rows of 0.1 s. The first tenth of a run is taken for "
        f"healthy. An alarm is raised when {SOME} of {OF} rows in a row are flagged.\n\n"
    )
    if chosen.figure is not None:
        draw(runs, chosen.figure)
    publish(chosen, {"runs": text + markdown(alarms, digits=2)})
