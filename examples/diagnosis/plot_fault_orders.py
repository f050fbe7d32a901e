"""
A fault that was never recorded
===============================

There is no recording of a fault of this machine. Its bearing and its speed are known,
and so are the orders of the impacts of a fault at each place. `FaultOrderClassifier`
identifies the place from these orders. The recording is of the SpectraQuest rig if it
is available; otherwise it is simulated.
"""

import matplotlib.pyplot as plt

from skarxlag import make_fault_order_classifier
from skarxlag.datasets import fetch_hit_sm, simulate_rig
from skarxlag.plotting import EnvelopeSpectrumDisplay

# %%
# A recording of a fault of the outer race is cut into rows of a second or more. Only
# the bearing and the nominal speed are known.
try:
    rig = fetch_hit_sm(window_length=51_200, download_if_missing=False)
    rows, rpm = rig.data[(rig.target == "OR5") & (rig.rpm == 900)], 900
except OSError:
    rig = simulate_rig(
        rpm=(500,),
        crack_mm=6,
        conditions=["Normal", "OR"],
        n_samples=1_000_000,
        window_length=500_000,
    )
    rows, rpm = rig.data[rig.target == "OR", :1, :], 500
rows = rows.reshape(len(rows), -1)

# %%
# The pipeline contains a model of the signal and the classifier. It is fitted on the
# rows that are diagnosed.
classifier = make_fault_order_classifier(
    bearing="6205", sampling_rate=rig.sampling_rate
).fit(rows)
print("places:", classifier.predict(rows, rpm=rpm).tolist())
print("p-values:", classifier.p_values(rows, rpm=rpm).round(5).tolist())

# %%
# The plot shows the evidence: the contrast of the envelope spectra, and the comb that
# fits best.
EnvelopeSpectrumDisplay.from_estimator(classifier, rows[0], rpm=rpm)
plt.show()
