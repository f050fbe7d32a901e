"""Figure of the page on recordings: the kept windows, and the limits of resampling.

``python -m benchmarks.pages.recordings_figure`` writes docs/images/recordings.svg. The
recording is simulated: white noise, which fills all frequencies.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import welch

from benchmarks.pages.svg_figures import BLUE, GREY, ORANGE, saved_figure
from skarxlag import load_recordings, read_recording_table

LENGTH, RATE, NEW_RATE = 1200, 25_600, 51_200
#: Ways to cut windows: the label in the figure, and the arguments.
WAYS = {
    "all": {},
    "hop=2400": {"hop": 2400},
    "hop=600": {"hop": 600},
    "max_windows=6": {"max_windows": 6},
}


def draw(path):
    """Draw the figure.

    Parameters
    ----------
    path : Path
        File to write.
    """
    with tempfile.TemporaryDirectory() as folder:
        np.save(
            Path(folder, "noise.npy"),
            np.random.default_rng(0).normal(size=20 * LENGTH + 500),
        )
        starts = {
            name: load_recordings(
                folder, window_length=LENGTH, sampling_rate=RATE, **way
            ).start
            for name, way in WAYS.items()
        }
        (resampled,) = read_recording_table(
            folder, sampling_rate=RATE, resample=NEW_RATE
        ).recordings
        recorded = np.load(Path(folder, "noise.npy"))
    with saved_figure(path, 1, 2, size=(9.0, 2.6), width_ratios=(3, 2)) as axes:
        kept, spectrum = axes[0]
        for row, starts_of_way in enumerate(starts.values()):
            for number, start in enumerate(starts_of_way):
                # Windows that share samples stand on two levels.
                kept.broken_barh(
                    [(start + 20, LENGTH - 40)],
                    (row - 0.3 + 0.32 * (number % 2), 0.28),
                    color=(BLUE, ORANGE)[number % 2],
                )
        kept.axvline(len(recorded), color=GREY, linestyle="--")
        kept.set_yticks(range(len(starts)), list(starts))
        kept.invert_yaxis()
        kept.set_xlabel("sample of the recording")
        kept.set_title("Windows that are kept", fontsize=9)
        for signal, rate, colour, name in (
            (recorded, RATE, BLUE, "recorded"),
            (resampled, NEW_RATE, ORANGE, "resampled"),
        ):
            frequency, power = welch(signal, rate, nperseg=512)
            level = 10 * np.log10(power[1:-1] * RATE / 2)
            spectrum.plot(
                frequency[1:-1] / 1000,
                level,
                color=colour,
                label=f"{name}, {rate:g} Hz",
            )
        spectrum.set_ylim(-100, 20)
        spectrum.set_xlabel("frequency (kHz)")
        spectrum.set_ylabel("power (dB)")
        spectrum.legend(frameon=False, fontsize=8)
        spectrum.set_title("White noise, brought to twice the rate", fontsize=9)


def main(argv=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--figure", type=Path, default=Path("docs/images/recordings.svg")
    )
    args = parser.parse_args(argv)
    draw(args.figure)


if __name__ == "__main__":
    main()
