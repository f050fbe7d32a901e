"""
Does a second sensor help?
==========================

Two sensors measure one bearing. `SensorFusion` fits a diagnoser for each, and joins
their log probabilities. The second sensor of this simulated rig has the same signal
through a longer path, with more noise.
"""

import matplotlib.pyplot as plt
import numpy as np

from skarxlag import SensorFusion, make_diagnoser
from skarxlag.datasets import simulate_rig

# %%
rig = simulate_rig(
    rpm=(400, 500), crack_mm=3, conditions=["Normal", "IR", "OR"], n_samples=36_000
)
near = rig.data[:, 0]
rng = np.random.default_rng(0)
trained = rig.rpm == 500

# %%
# The program adds more and more noise to the near sensor, up to twice its own signal.
# The noise of the far sensor stays the same.
levels = [0, 0.25, 0.5, 1, 2]
far = 0.5 * near + 0.5 * near.std() * rng.normal(size=near.shape)
accuracy = {"near sensor": [], "far sensor": [], "both": []}
for level in levels:
    noisy = near + level * near.std() * rng.normal(size=near.shape)
    sensors = {
        "near sensor": (make_diagnoser(), noisy),
        "far sensor": (make_diagnoser(), far),
        "both": (
            SensorFusion(estimator=make_diagnoser()),
            np.stack([noisy, far], axis=1),
        ),
    }
    for name, (estimator, X) in sensors.items():
        estimator.fit(X[trained], rig.target[trained])
        accuracy[name].append(estimator.score(X[~trained], rig.target[~trained]))
    scores = "  ".join(f"{name} {values[-1]:.2f}" for name, values in accuracy.items())
    print(f"noise {level:4}: {scores}")

# %%
# Joining helps a little if the sensors are about equally good. It does not protect
# against a bad one: with more noise, both together are worse than the far sensor alone.
fig, ax = plt.subplots(layout="constrained", figsize=(6, 3.5))
for (name, values), style in zip(accuracy.items(), ("--", ":", "-"), strict=True):
    ax.plot(levels, values, style, marker="o", label=name)
ax.set(xlabel="noise of the near sensor (RMS of its signal)", ylabel="accuracy")
ax.legend()
plt.show()
