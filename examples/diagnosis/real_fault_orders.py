"""
Can a fault be named without any training?
==========================================

Fourteen recordings of the MFPT society have a fault of the inner or of the outer race,
at seven loads. No recording is used for training. The bearing and its speed are known,
so the orders of the impacts are known, too. How clear is the comb of each fault
location?
"""

# sphinx_gallery_thumbnail_path = 'images/gallery/real_fault_orders.png'
import matplotlib.pyplot as plt
import numpy as np

from skarxlag import BearingGeometry, make_fault_order_classifier
from skarxlag.datasets import load_public_rig

# %%
# A row is a recording of three seconds. The classifier is fitted on the very rows that
# it diagnoses: it identifies a model of the signal, and needs no labels.
rig = load_public_rig(
    "mfpt", where="fs == 48828 and fault_type != 'normal'", window_length=146_484
)
bearing = BearingGeometry(8, element_diameter=5.969, pitch_diameter=31.623)
classifier = make_fault_order_classifier(
    bearing=bearing, sampling_rate=rig.sampling_rate
)
classifier.fit(rig.data)
diagnosis = classifier.diagnose(rig.data, rpm=rig.rpm)
right = np.array(diagnosis.named) == rig.target
print(f"{right.sum()} of {len(right)} recordings are named right")
print(diagnosis.evidence[0])

# %%
# The plot shows how likely each fault location is.
names = list(classifier.classes_)
probability = classifier.predict_proba(rig.data, rpm=rig.rpm)
order = np.argsort(rig.target, kind="stable")
fig, ax = plt.subplots(layout="constrained", figsize=(7, 4))
image = ax.imshow(probability[order], cmap="cividis", vmin=0, vmax=1, aspect="auto")
ax.set_xticks(range(len(names)), names)
labels = [f"{rig.target[i]}, load {rig.load[i]:g}" for i in order]
ax.set_yticks(range(len(labels)), labels)
ax.set_xlabel("verdict")
fig.colorbar(image, label="probability")
plt.show()
