"""
Which gains of the observers are best?
======================================

With the parameter ``memory``, a Pipeline stores the result of its first step. A search
over the gains of the observers then identifies the model only once for each split. Unstable
gains get the score NaN.
"""

import warnings
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from sklearn.exceptions import FitFailedWarning
from sklearn.model_selection import GridSearchCV

from skarxlag import SpeedSplit, make_extended_state_pio
from skarxlag.datasets import simulate_rig

# %%
# The search uses splits between 400 and 500 rpm. 300 rpm is left out for an unbiased
# score.
rig = simulate_rig(
    rpm=(300, 400, 500),
    crack_mm=3,
    conditions=["Normal", "IR", "OR", "Ball"],
    n_samples=24_000,
)
seen = rig.rpm > 300
X, y = rig.data[seen], rig.target[seen]
groups = list(zip(rig.rpm[seen], rig.recording[seen], strict=True))

# %%
grid = {"observe__ki": [0.002, 0.01, 0.03, 0.1, 1.0], "observe__saturation": [0.0, 1.0]}
with TemporaryDirectory() as cache, warnings.catch_warnings():
    # An integral gain of 1 is unstable. Its score is NaN.
    warnings.simplefilter("ignore", FitFailedWarning)
    warnings.filterwarnings("ignore", "One or more of the test scores", UserWarning)
    search = GridSearchCV(make_extended_state_pio(memory=cache), grid, cv=SpeedSplit())
    search.fit(X, y, groups=groups)
print("simulated rig, best gains between 400 and 500 rpm:", search.best_params_)

# %%
# The plot shows the mean accuracy between 400 and 500 rpm. A hatched cell is
# unstable. The integral gain sets how fast the observers follow the fault, and how wide
# the band of each one is. With a saturation of 0, the observers are linear.
ki, saturation = grid["observe__ki"], grid["observe__saturation"]
# The parameters of the grid are in alphabetical order; the last one changes fastest.
shape = len(ki), len(saturation)
accuracy = search.cv_results_["mean_test_score"].reshape(shape).T
_, ax = plt.subplots(layout="constrained")
ax.patch.set(hatch="///", edgecolor="grey")
image = ax.imshow(np.ma.masked_invalid(accuracy), cmap="cividis")
for (row, column), score in np.ndenumerate(accuracy):
    if np.isfinite(score):
        inside = {
            "ha": "center",
            "va": "center",
            "bbox": {"facecolor": "white", "alpha": 0.8},
        }
        ax.text(column, row, f"{score:.3f}", **inside)
ax.set(xlabel="ki", ylabel="saturation")
ax.set_xticks(range(len(ki)), ki)
ax.set_yticks(range(len(saturation)), saturation)
plt.colorbar(image, label="Accuracy of single windows")
plt.show()

# %%
# The score at the speed that was left out:
score = make_extended_state_pio().set_params(**search.best_params_).fit(X, y)
print(f"at 300 rpm: {score.score(rig.data[~seen], rig.target[~seen]):.3f}")

# %%
# A notebook displays the search as a diagram. A click on a step shows its parameters,
# and the question mark is a link to its page.
search
