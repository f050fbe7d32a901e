"""
How long should a window be?
============================

A longer window holds more impacts, but a recording has fewer of them to train on. The
diagnoser is fitted on the first halves of the recordings of the SpectraQuest rig at
one speed, and tested on the second halves at the others.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_window_length.png'
import matplotlib.pyplot as plt
import numpy as np
from sklearn.model_selection import cross_val_score

from skarxlag import SpeedSplit, make_diagnoser
from skarxlag.datasets import load_public_rig

# %%
# Each score is the mean over all pairs of speeds; the bar shows the worst and the best
# pair.
lengths = [1200, 2400, 4800, 9600]
scores = []
for length in lengths:
    rig = load_public_rig(
        "hit_sm",
        where="rig == 'spectraquest'",
        condition=["fault_type", "fault_severity"],
        window_length=length,
    )
    groups = np.column_stack([rig.rpm, rig.recording])
    scores.append(
        cross_val_score(
            make_diagnoser(),
            rig.data,
            rig.target,
            groups=groups,
            cv=SpeedSplit(),
        )
    )
    revolutions = 900 / 60 * length / rig.sampling_rate
    print(
        f"{length:5} samples, {revolutions:.2f} revolutions at 900 rpm: "
        f"accuracy {scores[-1].mean():.3f}"
    )

# %%
mean, worst, best = np.mean(scores, 1), np.min(scores, 1), np.max(scores, 1)
fig, ax = plt.subplots(layout="constrained", figsize=(6, 3.5))
ax.errorbar(lengths, mean, [mean - worst, best - mean], marker="o", capsize=4)
ax.set_xscale("log", base=2)
ax.set_xticks(lengths, lengths)
ax.set(xlabel="samples in a window", ylabel="accuracy at other speeds", ylim=(0, 1.02))
ax.grid(alpha=0.3)
plt.show()
