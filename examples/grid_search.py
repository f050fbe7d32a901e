"""
A grid search over observer gains that identifies once
======================================================

With ``memory`` a Pipeline keeps what its first step computed, so a search over gains of the
observer identifies the models once for each split. Gains that are not certified stable are
scored NaN.
"""

import warnings
from tempfile import TemporaryDirectory

from sklearn.exceptions import FitFailedWarning
from sklearn.model_selection import GridSearchCV

from skarxlag import make_alpio, speed_splits
from skarxlag.datasets import simulate_rig

# %%
# Gains are searched on the splits between 400 and 500 rpm. 300 rpm stays out for an honest score.
rig = simulate_rig(
    rpm=(300, 400, 500), crack_mm=3, conditions=["Normal", "IR", "OR", "Ball"], n_samples=24_000
)
seen = rig.rpm > 300
X, y = rig.data[seen], rig.target[seen]
splits = speed_splits(rig.rpm[seen], recording=rig.recording[seen])

# %%
grid = {"observe__kp": [0.0, 0.1, 0.5], "observe__ki": [0.0, 0.05, 3.0]}
with TemporaryDirectory() as cache, warnings.catch_warnings():
    # ki=3 is unstable with every kp here, and is there to show what happens then.
    warnings.simplefilter("ignore", FitFailedWarning)
    warnings.filterwarnings("ignore", "One or more of the test scores", UserWarning)
    search = GridSearchCV(make_alpio(memory=cache), grid, cv=splits).fit(X, y)

print("simulated rig, mean accuracy between 400 and 500 rpm")
results = search.cv_results_
for parameters, score in zip(results["params"], results["mean_test_score"], strict=True):
    print(f"kp {parameters['observe__kp']:<4} ki {parameters['observe__ki']:<5} {score:.3f}")
print("best:", search.best_params_)

# %%
# At a speed that no split has seen.
score = make_alpio().set_params(**search.best_params_).fit(X, y)
print(f"at 300 rpm: {score.score(rig.data[~seen], rig.target[~seen]):.3f}")
