"""
Does an alarm hold at another speed?
====================================

A detector is fitted on healthy recordings at three speeds of the UESTC rig, and tested
at a fourth speed. Its limits widen with the distance from the speeds of the fit.
Healthy recordings therefore raise few alarms, and some faults of the ball are missed.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_detection.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_detector
from skarxlag.datasets import load_public_rig

# %%
# Rows are windows of a quarter of a second. Each speed is left out of the fit in turn.
RATE = 0.02
rig = load_public_rig("uestc", window_length=5000)
is_healthy = rig.target == "healthy"
speeds = np.unique(rig.rpm)
p_values = np.empty(len(rig.data))
for speed in speeds:
    trained = is_healthy & (rig.rpm != speed)
    detector = make_detector(false_alarm_rate=RATE)
    detector.fit(rig.data[trained], rpm=rig.rpm[trained])
    tested = rig.rpm == speed
    p_values[tested] = detector.p_values(rig.data[tested], rpm=rig.rpm[tested])
    flagged = p_values[tested] < RATE
    alarms = flagged[is_healthy[tested]].mean()
    faults = flagged[~is_healthy[tested]].mean()
    print(
        f"{speed:g} rpm: {alarms:.0%} of healthy rows flagged, {faults:.0%} of faults"
    )

# %%
# The p-value is the probability that a healthy row deviates at least as much.
fig, axes = plt.subplots(
    1, len(speeds), sharey=True, layout="constrained", figsize=(9, 3.5)
)
for ax, speed in zip(axes, speeds, strict=True):
    for position, name in enumerate(rig.target_names):
        shown = p_values[(rig.rpm == speed) & (rig.target == name)]
        ax.plot(np.full(len(shown), position), shown, "o", alpha=0.3, markersize=4)
    ax.axhline(RATE, color="black", linestyle="--", linewidth=1)
    ax.set_xticks(range(4), ["healthy", "ball", "inner", "outer"], rotation=45)
    ax.set_title(f"{speed:g} rpm left out", fontsize="medium")
axes[0].set(yscale="log", ylabel="p-value; dashed: stated rate")
plt.show()
