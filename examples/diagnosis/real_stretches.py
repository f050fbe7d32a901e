"""
Does a wrong nominal speed matter?
==================================

A diagnoser of stretches compares the orders at which the envelope has lines. Nominal
speeds of real machines are wrong by some percent. Here, the speed of the test is
stated wrong on purpose, by up to 10 %. The recordings are those of the SpectraQuest
rig.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_stretches.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_diagnoser
from skarxlag.datasets import load_public_rig
from skarxlag.plotting import OrderSpectrumDisplay

# %%
# Rows are stretches of a second, fitted at 600 rpm and tested at 900 rpm.
rig = load_public_rig(
    "hit_sm",
    where="rig == 'spectraquest'",
    condition=["fault_type", "fault_severity"],
    window_length=51_200,
)
trained, new = rig.rpm == 600, rig.rpm == 900
diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate)
diagnoser.fit(rig.data[trained], rig.target[trained], rpm=600)

# %%
for error in (0, 0.03, 0.05, 0.1):
    predicted = diagnoser.predict(
        rig.data[new], rpm=np.full(new.sum(), 900 * (1 + error))
    )
    print(
        f"stated {error:4.0%} too fast: {np.mean(predicted == rig.target[new]):.2f} right"
    )
predicted = diagnoser.predict(rig.data[new])
print(f"not stated: {np.mean(predicted == rig.target[new]):.2f} right")

# %%
# The plot shows the order spectrum of a stretch with a fault of the outer race, and the
# references of the two closest conditions. The title of each panel has the speed that
# was found: 945 rpm were stated.
outer = rig.data[new & (rig.target == "outer moderate")][0]
display = OrderSpectrumDisplay.from_estimator(diagnoser, outer, rpm=945)
display.figure_.set_size_inches(9, 6)
plt.show()
