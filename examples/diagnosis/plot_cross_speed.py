"""
How accurate are diagnosers at other speeds?
============================================

Three diagnosers are calibrated on the simulated rig at 500 rpm and tested at every
speed. All results come from a simulation. The benchmark contains results on real rigs.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from skarxlag import (
    SpeedSplit,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)
from skarxlag.datasets import simulate_rig
from skarxlag.model_selection import Split, evaluate
from skarxlag.plotting import SpeedAccuracyDisplay

# %%
# Four conditions, cracks of 3 mm.
rig = simulate_rig(
    rpm=(300, 400, 500),
    crack_mm=3,
    conditions=["Normal", "IR", "OR", "Ball"],
    n_samples=60_000,
)
diagnosers = {
    "ALPIO": make_alpio(healthy="Normal"),
    "extended state": make_extended_state_pio(healthy="Normal"),
    "recommended": make_diagnoser(healthy="Normal"),
}

# %%
# Diagnosers are fitted on the first half of each recording at 500 rpm and tested on the
# second halves at all speeds. A hollow marker is a test at the training speed.
_, ax = plt.subplots(layout="constrained")
groups = np.column_stack([rig.rpm, rig.recording])
cv = SpeedSplit(train_rpm=500, same_speed=True)
splits = [Split(*rows, "speed", 500.0) for rows in cv.split(None, groups=groups)]
facts = pd.DataFrame({"rpm": rig.rpm})
verdicts = evaluate(diagnosers, rig.data, rig.target, facts, splits=splits)
print("simulated rig, calibrated at 500 rpm: accuracy of single windows")
for name, of_one in verdicts.groupby("estimator", sort=False):
    display = SpeedAccuracyDisplay(
        of_one["true"],
        of_one["predicted"],
        train_rpm=500,
        test_rpm=of_one["rpm"],
        name=name,
    ).plot(ax=ax)
    scores = zip(display.test_rpm, display.accuracy[0], strict=True)
    print(f"{name:14}", *(f"  {speed:g} rpm {score:.2f}" for speed, score in scores))
ax.axhline(1 / 4, color="grey", linestyle=":")
ax.annotate(
    "chance", (300, 1 / 4), textcoords="offset points", xytext=(0, 4), color="grey"
)
plt.show()
