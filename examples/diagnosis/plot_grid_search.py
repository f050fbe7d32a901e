"""
A grid search over observer gains that identifies once
======================================================

With the parameter ``memory``, a Pipeline stores the result of its first step. A search over the
gains of the observer then identifies the models only once for each split. Gains whose stability
cannot be certified get the score NaN.
"""

import warnings
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from sklearn.exceptions import FitFailedWarning
from sklearn.model_selection import GridSearchCV

from skarxlag import SpeedSplit, make_alpio
from skarxlag.datasets import simulate_rig

# %%
# Gains are searched on the splits between 400 and 500 rpm. 300 rpm stays out for an honest score.
rig = simulate_rig(
    rpm=(300, 400, 500), crack_mm=3, conditions=["Normal", "IR", "OR", "Ball"], n_samples=24_000
)
seen = rig.rpm > 300
X, y = rig.data[seen], rig.target[seen]
groups = list(zip(rig.rpm[seen], rig.recording[seen], strict=True))

# %%
grid = {"observe__kp": [-0.5, 0.0, 0.1, 0.5], "observe__ki": [0.0, 0.01, 0.05, 0.2, 1.0]}
with TemporaryDirectory() as cache, warnings.catch_warnings():
    # Some of these gains are unstable, and are there to show what happens then.
    warnings.simplefilter("ignore", FitFailedWarning)
    warnings.filterwarnings("ignore", "One or more of the test scores", UserWarning)
    search = GridSearchCV(make_alpio(memory=cache), grid, cv=SpeedSplit())
    search.fit(X, y, groups=groups)
print("simulated rig, best gains between 400 and 500 rpm:", search.best_params_)

# %%
# Mean accuracy between 400 and 500 rpm. A hatched cell was not certified stable. With both gains at
# 0 the error is the innovation itself, and the observer does nothing. Wrong gains cost more than
# half of the accuracy; on this rig, no gain is better than 0.
kp, ki = grid["observe__kp"], grid["observe__ki"]
# The grid's parameters run in alphabetical order, the last one fastest.
accuracy = search.cv_results_["mean_test_score"].reshape(len(ki), len(kp)).T
_, ax = plt.subplots(layout="constrained")
ax.patch.set(hatch="///", edgecolor="grey")
image = ax.imshow(np.ma.masked_invalid(accuracy), cmap="cividis")
for (row, column), score in np.ndenumerate(accuracy):
    if np.isfinite(score):
        inside = {"ha": "center", "va": "center", "bbox": {"facecolor": "white", "alpha": 0.8}}
        ax.text(column, row, f"{score:.3f}", **inside)
ax.set(xlabel="ki", ylabel="kp")
ax.set_xticks(range(len(ki)), ki)
ax.set_yticks(range(len(kp)), kp)
plt.colorbar(image, label="Accuracy of single windows")
plt.show()

# %%
# At a speed that no split has seen.
score = make_alpio().set_params(**search.best_params_).fit(X, y)
print(f"at 300 rpm: {score.score(rig.data[~seen], rig.target[~seen]):.3f}")

# %%
# The search, as a notebook shows it. A step opens to its parameters, and its question mark leads to
# its page.
search
