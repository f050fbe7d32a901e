"""
Which windows carry no signal?
==============================

Sensors fall off, cables break, and amplifiers saturate. `signal_quality` finds such
windows without any calibration. A real recording of the UESTC rig is damaged in several
ways here.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_quality.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import signal_quality
from skarxlag.datasets import load_public_rig

# %%
# Half a second of an outer race fault at 1000 rpm, and what may happen to it.
rig = load_public_rig("uestc", window_length=10_000)
good = rig.data[(rig.target == "outer") & (rig.rpm == 1000)][0]
time = np.arange(len(good)) / rig.sampling_rate
limit = np.quantile(np.abs(good), 0.95)
lost = np.where((time > 0.2) & (time < 0.3), good[np.argmax(time > 0.2)], good)
damaged = {
    "as recorded": good,
    "saturated": np.clip(good, -limit, limit),
    "a loose cable for 0.1 s": lost,
    "hum of the mains": good + 200 * good.std() * np.sin(2 * np.pi * 50 * time),
    "3 bits": np.round(good / np.ptp(good) * 6),
    "unplugged": np.zeros_like(good),
}

# %%
quality, share = signal_quality(
    list(damaged.values()), sampling_rate=rig.sampling_rate, return_share=True
)
fig, axes = plt.subplots(3, 2, sharex=True, layout="constrained", figsize=(8, 5))
rows = zip(axes.ravel(), damaged.items(), quality, share, strict=True)
for ax, (name, signal), verdict, affected in rows:
    print(f"{name:24} {verdict:10} {affected:.0%}")
    color = "tab:blue" if verdict == "good" else "tab:red"
    ax.plot(time, signal, linewidth=0.4, color=color)
    ax.set_title(f"{name}: {verdict}", fontsize="medium", loc="left")
    ax.set_yticks([])
for ax in axes[-1]:
    ax.set_xlabel("time (s)")
plt.show()
