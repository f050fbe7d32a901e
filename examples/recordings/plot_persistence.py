"""
Does a saved model give the same answers?
=========================================

`save_diagnoser` writes a fitted diagnoser and facts about it into a file that holds no
code. The loaded diagnoser returns the same probabilities, to the last bit. The
recordings are simulated.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skarxlag import load_diagnoser, make_diagnoser, save_diagnoser
from skarxlag.datasets import simulate_rig

# %%
rig = simulate_rig(
    rpm=(400, 500), crack_mm=3, conditions=["Normal", "IR", "OR"], n_samples=36_000
)
trained = rig.rpm == 500
diagnoser = make_diagnoser(healthy="Normal").fit(rig.data[trained], rig.target[trained])
path = Path(tempfile.mkdtemp()) / "bearing.skops"
save_diagnoser(
    diagnoser, path, sampling_rate=rig.sampling_rate, conditions=rig.target_names
)
print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")

# %%
# The file states how the windows were made. Commands such as ``skarxlag diagnose`` need
# these facts to cut recordings in the same way.
loaded, facts = load_diagnoser(path)
print("sampling rate:", facts["sampling_rate"], "conditions:", facts["conditions"])
before = diagnoser.predict_proba(rig.data[~trained])
after = loaded.predict_proba(rig.data[~trained])
print("largest difference:", np.abs(after - before).max())

# %%
# The plot shows the probability of the true condition at 400 rpm before and after.
true = diagnoser.classes_.searchsorted(rig.target[~trained])
rows = np.arange(len(true))
fig, ax = plt.subplots(layout="constrained", figsize=(4, 4))
ax.plot([0, 1], [0, 1], color="grey", linewidth=1)
ax.plot(before[rows, true], after[rows, true], ".", alpha=0.5)
ax.set(xlabel="before saving", ylabel="after loading", aspect="equal")
plt.show()
