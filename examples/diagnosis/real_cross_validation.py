"""
How does it fit into a benchmark script?
========================================

A script compares classifiers by `cross_val_score`. A diagnoser is one more entry of its
dictionary, and a splitter of speeds is one more argument. The recordings are those of
the SpectraQuest rig, at three speeds.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_cross_validation.png'
import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import StratifiedKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from skarxlag import SpeedSplit, make_diagnoser
from skarxlag.datasets import load_public_rig


# %%
def log_spectrum(X):
    """Compute the log spectra of windows of unit RMS."""
    return np.log(welch(X / X.std(axis=1, keepdims=True))[1][:, 1:])


rig = load_public_rig(
    "hit_sm",
    where="rig == 'spectraquest'",
    condition=["fault_type", "fault_severity"],
    window_length=9600,
)
spectra = FunctionTransformer(log_spectrum)
lda = LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")
classifiers = {
    "random forest": make_pipeline(spectra, RandomForestClassifier(20, random_state=0)),
    "LDA": make_pipeline(spectra, lda),
    "make_diagnoser": make_diagnoser(),
}

# %%
# Random folds put windows of one recording on both sides. `SpeedSplit` trains at one
# speed and tests at another, on another half of the recordings.
groups = np.column_stack([rig.rpm, rig.recording])
splitters = {
    "random folds": StratifiedKFold(3, shuffle=True, random_state=0),
    "other speeds": list(SpeedSplit().split(rig.data, groups=groups)),
}
fig, ax = plt.subplots(layout="constrained", figsize=(7, 3))
for shift, (split, cv) in zip((-0.1, 0.1), splitters.items(), strict=True):
    for row, (name, classifier) in enumerate(classifiers.items()):
        scores = cross_val_score(classifier, rig.data, rig.target, cv=cv)
        print(f"{split}, {name:15} mean {scores.mean():.3f}  worst {scores.min():.3f}")
        color = "tab:blue" if split == "other speeds" else "tab:grey"
        ax.plot(scores, np.full(len(scores), row + shift), "o", color=color, alpha=0.5)
    ax.plot([], [], "o", color=color, label=split)

# %%
# The plot shows the accuracy of each fold. Random folds make every classifier look
# good.
ax.set_yticks(range(len(classifiers)), classifiers)
ax.set_xlabel("accuracy of single windows, a dot for each fold")
ax.legend()
plt.show()
