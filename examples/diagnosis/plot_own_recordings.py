"""
How do files become verdicts?
=============================

This example shows how to diagnose your own recordings. A table lists the files. A
diagnoser is calibrated at one speed and saved, and then gives one verdict for each
recording at another speed. Here, the files come from the simulated rig. The shell
commands ``python -m skarxlag fit`` and ``diagnose`` do the same.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from sklearn.metrics import ConfusionMatrixDisplay

from skarxlag import load_diagnoser, load_recordings, make_diagnoser, save_diagnoser
from skarxlag.datasets import simulate_rig

# %%
# A folder contains one file for each recording, with two named channels.
folder = Path(tempfile.mkdtemp())
rig = simulate_rig(
    rpm=(400, 500),
    crack_mm=3,
    conditions=["Normal", "IR", "OR", "Ball"],
    n_samples=60_000,
)
lines = ["path,condition,rpm,sampling_rate,channel"]
for name in np.unique(rig.recording):
    is_recording = rig.recording == name
    emission, torque = np.moveaxis(rig.data[is_recording], 1, 0).reshape(2, -1)
    np.savez(folder / f"{name}.npz", emission=emission, torque=torque)
    condition, speed = rig.target[is_recording][0], rig.rpm[is_recording][0]
    lines.append(
        f"{name}.npz,{condition},{speed:g},{rig.sampling_rate:g},emission;torque"
    )
(folder / "table.csv").write_text("\n".join(lines))
print("\n".join(lines))

# %%
# The recordings of the table are cut into windows. A diagnoser is fitted on those of
# 500 rpm and saved.
bench = load_recordings(folder / "table.csv", window_length=1200, healthy="Normal")
at_500 = bench.rpm == 500
diagnoser = make_diagnoser(healthy="Normal").fit(
    bench.data[at_500], bench.target[at_500]
)
save_diagnoser(diagnoser, folder / "bearing.skops", sampling_rate=bench.sampling_rate)

# %%
# The loaded diagnoser gives one verdict for each recording at 400 rpm, from all of its
# windows.
loaded, facts = load_diagnoser(folder / "bearing.skops")
for name in np.unique(bench.recording[~at_500]):
    windows = bench.data[bench.recording == name]
    evidence = loaded.predict_log_proba(windows).sum(axis=0)
    print(f"{Path(name).name:22} {loaded.classes_[evidence.argmax()]}")

# %%
# Single windows are more difficult. This is the confusion matrix on the simulated rig,
# fitted at 500 rpm and tested at 400 rpm.
ConfusionMatrixDisplay.from_estimator(
    loaded,
    bench.data[~at_500],
    bench.target[~at_500],
    labels=bench.target_names,
    cmap="cividis",
)
plt.show()
