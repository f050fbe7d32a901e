"""
Which formats can be read?
==========================

A simulated recording is written in four formats and read again. How large are the
files, and how exact? A file of 16 bits is the smallest, and loses a little of the
signal.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.io import savemat, wavfile

from skarxlag import list_channels, read_recording
from skarxlag.datasets import simulate_rig

# %%
# A recording of an outer race fault: 48 ms at 250 kHz.
rig = simulate_rig(rpm=500, crack_mm=6, conditions="OR", n_samples=12_000)
emission = rig.data[:, 0].ravel()
folder = Path(tempfile.mkdtemp())
np.save(folder / "run.npy", emission)
savemat(folder / "run.mat", {"emission": emission})
pd.DataFrame({"emission": emission}).to_csv(folder / "run.csv", index=False)
scaled = emission / np.abs(emission).max()
wavfile.write(folder / "run.wav", 250_000, np.round(scaled * 32767).astype(np.int16))

# %%
# `list_channels` returns the channels of a file. `read_recording` returns the signal
# and its sampling rate, or None if the file does not state one.
fig, ax = plt.subplots(layout="constrained", figsize=(7, 3))
for name in ("run.npy", "run.mat", "run.csv", "run.wav"):
    signal, rate = read_recording(folder / name)
    signal = np.ravel(signal)
    error = np.abs(signal / np.abs(signal).max() - scaled)
    size = (folder / name).stat().st_size
    channels = list_channels(folder / name)["channel"].tolist()
    print(f"{name}: channels {channels}, rate {rate}, {size / 1000:.0f} kB")
    ax.plot(size / 1000, error.max(), "o")
    ax.annotate(f" {name}", (size / 1000, error.max()))
ax.set_yscale("symlog", linthresh=1e-7)
ax.set(xlabel="size of the file (kB)", ylabel="largest error (of the peak)")
ax.set(xlim=(0, 300), ylim=(-1e-7, 1e-3))
plt.show()
