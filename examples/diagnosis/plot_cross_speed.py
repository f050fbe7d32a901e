"""
How accurate are diagnosers at other speeds?
============================================

Three diagnosers are calibrated on the simulated rig at 500 rpm and tested at every
speed. All results come from a simulation. The benchmark contains results on real rigs.
"""

import matplotlib.pyplot as plt
import numpy as np

from skarxlag import (
    SpeedSplit,
    cross_speed_predict,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)
from skarxlag.datasets import simulate_rig
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
print("simulated rig, calibrated at 500 rpm: accuracy of single windows")
for name, diagnoser in diagnosers.items():
    verdicts = cross_speed_predict(
        diagnoser, rig.data, rig.target, groups=groups, cv=cv
    )
    display = SpeedAccuracyDisplay(
        verdicts["true"],
        verdicts["predicted"],
        train_rpm=500,
        test_rpm=rig.rpm[verdicts["window"]],
        name=name,
    ).plot(ax=ax)
    scores = zip(display.test_rpm, display.accuracy[0], strict=True)
    print(f"{name:14}", *(f"  {speed:g} rpm {score:.2f}" for speed, score in scores))
ax.axhline(1 / 4, color="grey", linestyle=":")
ax.annotate(
    "chance", (300, 1 / 4), textcoords="offset points", xytext=(0, 4), color="grey"
)
plt.show()
