"""
Calibrated at one speed, used at others
=======================================

The three diagnosers, calibrated on the simulated rig at 500 rpm and tested at every speed. All
figures come from a simulation; the benchmark has real rigs.
"""

import matplotlib.pyplot as plt

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio, speed_splits
from skarxlag.datasets import simulate_rig
from skarxlag.plotting import SpeedAccuracyDisplay

# %%
# Four conditions. Diagnosers are fitted on first halves of the recordings and tested on second
# halves, at the training speed too.
rig = simulate_rig(
    rpm=(300, 400, 500), crack_mm=3, conditions=["Normal", "IR", "OR", "Ball"], n_samples=60_000
)
splits = speed_splits(rig.rpm, train_rpm=500, recording=rig.recording, same_speed=True)

# %%
diagnosers = {
    "ALPIO": make_alpio(healthy="Normal"),
    "extended state": make_extended_state_pio(healthy="Normal"),
    "recommended": make_diagnoser(healthy="Normal"),
}
print("simulated rig, calibrated at 500 rpm: share of single windows that are right")
for name, diagnoser in diagnosers.items():
    train = splits[0][0]
    diagnoser.fit(rig.data[train], rig.target[train])
    scores = {
        rig.rpm[test[0]]: diagnoser.score(rig.data[test], rig.target[test]) for _, test in splits
    }
    print(f"{name:14}", *(f"  {speed:g} rpm {score:.2f}" for speed, score in scores.items()))

# %%
# The same as a figure, for the baseline.
SpeedAccuracyDisplay.from_estimator(
    diagnosers["ALPIO"],
    rig.data,
    rig.target,
    rpm=rig.rpm,
    recording=rig.recording,
    train_rpm=500,
    name="ALPIO",
)
plt.show()
