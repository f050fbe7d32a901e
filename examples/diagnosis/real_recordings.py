"""
Is a fault named at another speed?
==================================

A diagnoser is fitted on the recordings of the UESTC rig at 800 rpm and used on
recordings at 1000, 1200 and 1400 rpm. It needs no speed. If it is not sure of the fault
location, it says so. The example downloads 34 MB once.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_recordings.png'

import matplotlib.pyplot as plt
from sklearn.metrics import ConfusionMatrixDisplay

from skarxlag import make_diagnoser, recording_verdicts
from skarxlag.datasets import load_public_rig

# %%
# Conditions are healthy (N), and faults of a ball (B), of the inner race (I) and of the
# outer race (O).
rig = load_public_rig("uestc")
trained = rig.rpm == 800
print(
    f"{rig.data.shape[0]} windows of {rig.data.shape[1]} samples at {rig.sampling_rate:g} Hz"
)

# %%
# Fit at one speed, and compute one verdict for each recording at the others.
diagnoser = make_diagnoser(healthy="healthy").fit(
    rig.data[trained], rig.target[trained]
)
verdicts = recording_verdicts(
    diagnoser,
    rig.data[~trained],
    rig.recording[~trained],
    rpm=rig.rpm[~trained],
    train_rpm=[800],
)
print(verdicts["verdict"].to_string())

# %%
# A single window of 60 ms is less certain than a recording of 13 s.
predicted = diagnoser.predict(rig.data[~trained])
ConfusionMatrixDisplay.from_predictions(
    rig.target[~trained], predicted, labels=rig.target_names, colorbar=False
)
plt.title("Single windows at 1000, 1200 and 1400 rpm")
plt.show()
