"""
When does a running sensor raise its alarm?
===========================================

`ConditionMonitor` takes blocks of samples as a sensor delivers them. Here, five seconds
of a healthy bearing of the SpectraQuest rig are followed by five seconds with a fault
of the outer race. The monitor was fitted at other speeds.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_stream.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import ConditionMonitor, make_detector, make_diagnoser
from skarxlag.datasets import load_public_rig

# %%
# Diagnoser and detector are fitted on windows of 4800 samples at 600 and 1200 rpm.
LENGTH = 4800
rig = load_public_rig(
    "hit_sm",
    where="rig == 'spectraquest'",
    condition=["fault_type", "fault_severity"],
    window_length=LENGTH,
)
trained = rig.rpm != 900
healthy = trained & (rig.target == "healthy")
diagnoser = make_diagnoser(healthy="healthy")
diagnoser.fit(rig.data[trained], rig.target[trained], rpm=rig.rpm[trained])
detector = make_detector().fit(rig.data[healthy], rpm=rig.rpm[healthy])

# %%
# The stream arrives in blocks of 50 ms.
recordings = [
    rig.data[(rig.rpm == 900) & (rig.target == name)].ravel()
    for name in ("healthy", "outer moderate")
]
# The gain of the sensor differs between these two recordings.
stream = np.concatenate([signal / signal.std() for signal in recordings])
monitor = ConditionMonitor(
    diagnoser,
    rig.sampling_rate,
    detector=detector,
    window_length=LENGTH,
    half_life=1.0,
    conditions=rig.target_names,
)
verdicts = []
for block in np.array_split(stream, 200):
    verdicts += monitor.update(block, rpm=900)
change = len(recordings[0]) / rig.sampling_rate
alarm = next((verdict.time for verdict in verdicts if verdict.alarm), None)
print(f"the fault begins at {change:.2f} s, the alarm is raised at {alarm} s")
print("last verdict:", verdicts[-1].verdict, f"{verdicts[-1].probability:.0%}")

# %%
# The plot shows the probability of the current verdict.
fig, ax = plt.subplots(layout="constrained", figsize=(8, 3.2))
for name in dict.fromkeys(verdict.verdict for verdict in verdicts):
    shown = [verdict for verdict in verdicts if verdict.verdict == name]
    times = [verdict.time for verdict in shown]
    ax.plot(times, [verdict.probability for verdict in shown], "o", label=name)
ax.axvline(change, color="black", linewidth=1, label="the fault begins")
if alarm is not None:
    ax.axvline(alarm, color="tab:red", linestyle="--", label="alarm")
ax.set(xlabel="time (s)", ylabel="probability of the verdict", ylim=(0, 1.02))
ax.legend(fontsize="small", loc="lower right")
plt.show()
