"""
What does the comb of a fault look like?
========================================

A fault of the outer race causes impacts at the order BPFO of its bearing. The envelope
of the signal has lines at this order and at its multiples. The recording is that of
the SpectraQuest rig.
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_comb.png'
import matplotlib.pyplot as plt

from skarxlag import bearing_orders, make_fault_order_classifier
from skarxlag.datasets import load_public_rig
from skarxlag.plotting import EnvelopeSpectrumDisplay

# %%
# The bearing is a 6205, and the nominal speed is 900 rpm.
orders = bearing_orders("6205")
print("orders:", {name: round(order, 3) for name, order in orders.items()})
rig = load_public_rig(
    "hit_sm",
    where="rig == 'spectraquest'",
    condition=["fault_type", "fault_severity"],
    window_length=51_200,
)
rows = rig.data[(rig.target == "outer moderate") & (rig.rpm == 900)]

# %%
# The pipeline contains a model of the signal and the classifier. It is fitted on the
# rows that are diagnosed.
classifier = make_fault_order_classifier(
    bearing="6205", sampling_rate=rig.sampling_rate
).fit(rows)
print("fault locations:", classifier.predict(rows, rpm=900).tolist())

# %%
# The line is the contrast: how far the envelope spectrum rises above its surroundings.
# The dotted lines are the combs, at the speed and slip that fit best.
display = EnvelopeSpectrumDisplay.from_estimator(classifier, rows[0], rpm=900)
display.figure_.set_size_inches(9, 4)
display.ax_.title.set_fontsize("small")
plt.show()
