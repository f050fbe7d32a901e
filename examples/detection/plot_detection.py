"""
Detection with healthy data only
================================

A detector that has seen healthy windows alone flags what they do not reach, by the amplitude of
the innovations in the sensor's unit. The level grows with speed. Calibrated at the lowest speed, it
flags everything at the others; calibrated at the highest, it keeps its false-alarm rate and misses
faults that are quieter at lower speeds.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.pipeline import make_pipeline

from skarxlag import ARXLaguerre, FaultDetector, PIObserver
from skarxlag.datasets import simulate_rig

# %%
# First halves of healthy recordings calibrate, second halves of all recordings test.
SPEEDS = (300, 400, 500)
rig = simulate_rig(
    rpm=SPEEDS, crack_mm=3, conditions=["Normal", "IR", "OR", "Ball"], n_samples=120_000
)
is_first = rig.start < 60_000
is_healthy = rig.target == "Normal"
detector = make_pipeline(
    ARXLaguerre(unit_rms=False), PIObserver(), FaultDetector(false_alarm_rate=0.05)
)


def report(speed):
    """False alarms and detections on second halves at one speed."""
    tested = ~is_first & (rig.rpm == speed)
    false = (detector.predict(rig.data[tested & is_healthy]) == -1).mean()
    found = (detector.predict(rig.data[tested & ~is_healthy]) == -1).mean()
    return f"{speed} rpm: false alarms {false:4.0%}, faults found {found:4.0%}"


# %%
print("simulated rig, stated false-alarm rate 5 %")
for calibration in (min(SPEEDS), max(SPEEDS)):
    detector.fit(rig.data[is_first & is_healthy & (rig.rpm == calibration)])
    print(f"calibrated at {calibration} rpm")
    for speed in SPEEDS:
        print("   ", report(speed))

# %%
# Why: the residual levels of healthy and of faulty windows with the threshold of the highest speed,
# which was fitted last.
residual_levels = np.abs(detector[:-1].transform(rig.data)).ravel()
fig, axes = plt.subplots(1, len(SPEEDS), sharey=True, layout="constrained", figsize=(7, 3.5))
for ax, speed in zip(axes, SPEEDS, strict=True):
    tested = ~is_first & (rig.rpm == speed)
    ax.boxplot(
        [residual_levels[tested & (rig.target == name)] for name in rig.target_names],
        tick_labels=rig.target_names,
    )
    ax.axhline(detector[-1].detection_threshold_, color="tab:red", linestyle="--")
    ax.set(title=f"{speed} rpm", yscale="log")
axes[0].set_ylabel("Residual level; dashed: threshold")
plt.show()

# %%
# With healthy data at every speed, one detector for each.
print("calibrated at each speed")
for speed in SPEEDS:
    detector.fit(rig.data[is_first & is_healthy & (rig.rpm == speed)])
    print("   ", report(speed))
