"""
Calibrated at one speed, used at others
=======================================

Three diagnosers are calibrated on the simulated rig at 500 rpm and tested at every speed. All
results come from a simulation. The benchmark contains results on real rigs.
"""

import matplotlib.pyplot as plt

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio
from skarxlag.datasets import simulate_rig
from skarxlag.plotting import SpeedAccuracyDisplay

# %%
# Four conditions, cracks of 3 mm.
rig = simulate_rig(
    rpm=(300, 400, 500), crack_mm=3, conditions=["Normal", "IR", "OR", "Ball"], n_samples=60_000
)
diagnosers = {
    "ALPIO": make_alpio(healthy="Normal"),
    "extended state": make_extended_state_pio(healthy="Normal"),
    "recommended": make_diagnoser(healthy="Normal"),
}

# %%
# Given the recordings, a display fits on their first halves and tests on their second halves, at
# the training speed too. A hollow marker is a test at the training speed.
_, ax = plt.subplots(layout="constrained")
print("simulated rig, calibrated at 500 rpm: share of single windows that are right")
for name, diagnoser in diagnosers.items():
    display = SpeedAccuracyDisplay.from_estimator(
        diagnoser,
        rig.data,
        rig.target,
        rpm=rig.rpm,
        recording=rig.recording,
        train_rpm=500,
        name=name,
        ax=ax,
    )
    scores = zip(display.test_rpm, display.accuracy[0], strict=True)
    print(f"{name:14}", *(f"  {speed:g} rpm {score:.2f}" for speed, score in scores))
ax.axhline(1 / 4, color="grey", linestyle=":")
ax.annotate("chance", (300, 1 / 4), textcoords="offset points", xytext=(0, 4), color="grey")
plt.show()
