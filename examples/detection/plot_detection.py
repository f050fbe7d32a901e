"""
Detection with healthy recordings only
======================================

A detector is calibrated on healthy recordings at 300 and 500 rpm, and tested on
recordings at 400 and 600 rpm. Its limits widen with the distance from the calibrated
speeds. Healthy recordings therefore raise no alarm at either speed, and fewer faults
are found at the more distant speed.
"""

import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_detector
from skarxlag.datasets import simulate_rig

# %%
# Rows are stretches of 48 ms. The detector is fitted on healthy recordings at two
# speeds.
RATE = 0.02
rig = simulate_rig(
    rpm=(300, 400, 500, 600),
    crack_mm=3,
    conditions=["Normal", "IR", "OR", "Ball"],
    n_samples=300_000,
    window_length=12_000,
)
is_healthy = rig.target == "Normal"
is_known = is_healthy & np.isin(rig.rpm, [300, 500])
detector = make_detector(false_alarm_rate=RATE)
detector.fit(rig.data[is_known], rpm=rig.rpm[is_known])

# %%
# The program prints false alarms and detected faults at speeds that were not used for
# the fit.
p_values = detector.p_values(rig.data, rpm=rig.rpm)
print(f"simulated rig, stated false-alarm rate {RATE:.0%}")
for speed in (400, 600):
    shares = {
        name: np.mean(p_values[(rig.rpm == speed) & (rig.target == name)] < RATE)
        for name in rig.target_names
    }
    print(f"{speed} rpm: flagged", ", ".join(f"{k} {v:.0%}" for k, v in shares.items()))

# %%
# The p-value is the probability that a healthy row deviates at least as much.
fig, axes = plt.subplots(1, 2, sharey=True, layout="constrained", figsize=(7, 3.5))
for ax, speed in zip(axes, (400, 600), strict=True):
    shown = [
        p_values[(rig.rpm == speed) & (rig.target == name)] for name in rig.target_names
    ]
    ax.boxplot(shown, tick_labels=rig.target_names)
    ax.axhline(RATE, color="tab:red", linestyle="--")
    ax.set(title=f"{speed} rpm", yscale="log")
axes[0].set_ylabel("p-value; dashed: stated rate")
plt.show()
