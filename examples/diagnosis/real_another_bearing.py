"""
Is a fault named on another bearing?
====================================

A diagnoser is fitted on a healthy bearing and on one fault of each race. It is tested
at another speed, on bearings whose faults are larger. With the dimensions of the
bearing, combs at the orders of the faults count, too. The recordings are those of the
SpectraQuest rig.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_another_bearing.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_diagnoser
from skarxlag.datasets import load_public_rig

# %%
# Rows are stretches of a second. The name of a condition states the fault location and
# the size of the fault: slight, moderate or severe, an arc of 2, 5 or 8 degrees.
rig = load_public_rig(
    "hit_sm",
    where="rig == 'spectraquest'",
    condition=["fault_type", "fault_severity"],
    window_length=51_200,
)
locations = np.array([name.split()[0] for name in rig.target])
trained = np.isin(rig.target, ["healthy", "inner slight", "outer slight"]) & (
    rig.rpm == 600
)
others = np.isin(
    rig.target, ["inner moderate", "inner severe", "outer moderate", "outer severe"]
) & (rig.rpm == 900)

# %%
# The program prints the share of stretches whose fault location is right.
options = {"sampling_rate": rig.sampling_rate, "healthy": "healthy"}
diagnosers = {
    "spectra alone": make_diagnoser(**options),
    "spectra and combs": make_diagnoser(**options, bearing="6205"),
}
true = locations[others]
probability = {}
for name, diagnoser in diagnosers.items():
    diagnoser.fit(rig.data[trained], locations[trained], rpm=rig.rpm[trained])
    predicted = diagnoser.predict_proba(rig.data[others], rpm=rig.rpm[others])
    right = diagnoser.classes_[predicted.argmax(axis=1)] == true
    print(f"{name:18} {right.mean():.2f} right")
    probability[name] = predicted[
        np.arange(len(true)), diagnoser.classes_.searchsorted(true)
    ]

# %%
# The plot shows the probability of the true fault location for each stretch.
specimens = np.unique(rig.target[others])
fig, ax = plt.subplots(layout="constrained", figsize=(7, 3.5))
for shift, (name, values) in zip((-0.1, 0.1), probability.items(), strict=True):
    position = specimens.searchsorted(rig.target[others]) + shift
    ax.plot(values, position, "o", alpha=0.6, label=name)
ax.set_yticks(range(len(specimens)), specimens)
ax.set(xlabel="probability of the true fault location", xlim=(0, 1.02))
ax.legend()
plt.show()
