"""
What happens with a fault that was not trained?
===============================================

A diagnoser always has a most similar condition. Next to it, `make_known_conditions`
tests whether a row resembles any of them. Here, the fault of the ball of the UESTC rig
is left out of the training.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_unknown_condition.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_known_conditions
from skarxlag.datasets import load_public_rig

# %%
# Rows are stretches of 0.375 s. The first halves of the recordings at three
# speeds are for the fit, and the second halves at 1200 rpm for the test.
RATE = 0.02
rig = load_public_rig("uestc", window_length=7500)
is_first = rig.start < np.median(rig.start)
trained = is_first & np.isin(rig.rpm, [800, 1000, 1400]) & (rig.target != "ball")
conditions = make_known_conditions(false_rejection_rate=RATE)
conditions.fit(rig.data[trained], rig.target[trained], rpm=rig.rpm[trained])

# %%
tested = ~is_first & (rig.rpm == 1200)
p_values = conditions.p_values(rig.data[tested], rpm=rig.rpm[tested]).max(axis=1)
fig, ax = plt.subplots(layout="constrained", figsize=(6, 3.5))
for position, name in enumerate(rig.target_names):
    shown = p_values[rig.target[tested] == name]
    print(f"{name}: {np.mean(shown < RATE):.0%} rejected")
    ax.plot(np.full(len(shown), position), shown, "o", alpha=0.5)

# %%
# The plot shows the p-value of the nearest condition for each row. Below the dashed
# line, the condition is unknown.
ax.axhline(RATE, color="black", linestyle="--", linewidth=1)
labels = ["healthy", "ball (not trained)", "inner race", "outer race"]
ax.set_xticks(range(len(labels)), labels)
ax.set(yscale="log", ylabel="p-value of the nearest condition")
plt.show()
