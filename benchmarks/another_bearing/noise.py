"""Count how often signals without a known condition are named with a high probability.

Run ``python -m benchmarks.another_bearing noise`` from the root of the repository. Each
rig's diagnoser, trained at one setting, gets synthetic noise and sines, at the training
speed and at 1.5 times that speed, and the first second of each recording of all other
rigs, at their own speeds. `fit` receives no specimens.
"""

import sys

import numpy as np
import pandas as pd
from scipy import fft
from scipy.signal import lfilter

from benchmarks.another_bearing.arguments import parse
from benchmarks.another_bearing.methods import fitted
from benchmarks.another_bearing.metrics import STATED
from benchmarks.another_bearing.protocol import BEARINGS, folds
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.rigs import real_rigs


def synthetic(rate, n_samples, seed=0):
    """Return noises of several colours and distributions, and sines, by name."""
    rng = np.random.default_rng(seed)
    time = np.arange(n_samples) / rate
    white = rng.normal(size=(9, n_samples))
    spectrum = fft.rfft(white[8])
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    return {
        "white": white[0],
        "white, once more": white[1],
        "pink": fft.irfft(spectrum, n_samples),
        "brown": np.cumsum(white[2]),
        "violet": np.diff(white[3], prepend=0),
        "low frequencies": lfilter([1], [1, -0.9], white[4]),
        "high frequencies": lfilter([1], [1, 0.9], white[5]),
        "one band": lfilter([1], [1, -1.6, 0.9], white[6]),
        "uniform": rng.uniform(-1, 1, n_samples),
        "Laplace": rng.laplace(size=n_samples),
        "Student": rng.standard_t(3, size=n_samples),
        "sine of 50 Hz": np.sin(2 * np.pi * 50 * time) + 0.01 * white[7],
        "sine of 1 kHz": np.sin(2 * np.pi * 1000 * time) + 0.1 * white[7],
    }


def foreign_rows(name, n_samples, data_home):
    """Return the first samples of each recording of all other rigs, and their speeds."""
    recordings = [
        recording
        for other in BEARINGS
        if other != name
        for rig in real_rigs([other], data_home)
        for recording in rig.recordings
        if len(recording.samples) >= n_samples
    ]
    rows = np.stack([recording.samples[:n_samples] for recording in recordings])
    return rows, np.array([recording.rpm for recording in recordings])


def scored(rig, data_home):
    """Yield the kind of rows, their number, and how many are stated, for each setting."""
    n_samples = int(rig.sampling_rate)
    other, speeds = foreign_rows(rig.name, n_samples, data_home)
    for seed, fold in enumerate(folds(rig)):
        probabilities = fitted(rig, fold.train)
        noise = np.stack(list(synthetic(rig.sampling_rate, n_samples, seed).values()))
        speed = fold.train.rpm[0]
        kinds = {
            "noise and sines, training speed": (noise, np.full(len(noise), speed)),
            "noise and sines, 1.5 times the speed": (
                noise,
                np.full(len(noise), 1.5 * speed),
            ),
            "recordings of other rigs": (other, speeds),
        }
        for kind, (rows, rpm) in kinds.items():
            stated = probabilities(rows, rpm).max(axis=1) >= STATED
            yield {
                "rig": rig.name,
                "rows": kind,
                "number": len(rows),
                "stated": stated.sum(),
            }


def main(arguments=None):
    """Run the command."""
    options = parse(arguments, __doc__, "another_bearing_noise")
    rows = []
    for rig in real_rigs(options.rig, options.data_home):
        rows += scored(rig, options.data_home)
        print(rig.name, file=sys.stderr, flush=True)
    counts = pd.DataFrame(rows).groupby(["rows", "rig"], sort=False).sum().reset_index()
    counts.to_csv(options.output / "noise.csv", index=False)
    counts["stated"] = (
        counts["stated"].astype(str) + " of " + counts.pop("number").astype(str)
    )
    table = counts.pivot(index="rig", columns="rows", values="stated").reset_index()
    note = "Rows that `make_diagnoser` names with a probability of at least .9:"
    publish(options, {"another bearing noise": f"{note}\n\n{markdown(table)}"})
