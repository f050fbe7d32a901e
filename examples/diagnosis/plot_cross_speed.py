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

# %%
# Four conditions, cracks of 3 mm.
rig = simulate_rig(
    rpm=(300, 400, 500),
    crack_mm=3,
    conditions=["Normal", "IR", "OR", "Ball"],
    n_samples=60_000,
)
diagnosers = {
    "ALPIO": make_alpio(),
    "extended state": make_extended_state_pio(),
    "recommended": make_diagnoser(),
}

# %%
# Diagnosers are fitted on the first half of each recording at 500 rpm and tested on the
# second halves at all speeds.
groups = np.column_stack([rig.rpm, rig.recording])
cv = SpeedSplit(train_rpm=500, same_speed=True)
splits = [Split(*rows, "speed", 500.0) for rows in cv.split(None, groups=groups)]
facts = pd.DataFrame({"rpm": rig.rpm})
verdicts = evaluate(diagnosers, rig.data, rig.target, facts, splits=splits)
is_right = verdicts["true"] == verdicts["predicted"]
of_speeds = is_right.groupby([verdicts["rpm"], verdicts["estimator"]])
accuracy = of_speeds.mean().unstack()[list(diagnosers)]
print("simulated rig, calibrated at 500 rpm: accuracy of single windows")
print(accuracy.round(2))

# %%
ax = accuracy.plot(marker="o", ylim=(0, 1.03), grid=True, xticks=accuracy.index)
ax.set(xlabel="Shaft speed of the test (rpm)", ylabel="Accuracy")
ax.axhline(1 / 4, color="grey", linestyle=":")
ax.annotate(
    "chance", (300, 1 / 4), textcoords="offset points", xytext=(0, 4), color="grey"
)
plt.show()
