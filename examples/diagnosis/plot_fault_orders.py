"""
A fault that nobody recorded
============================

No recording of a fault was ever made at this machine. Its bearing and its speed are known, and so
are the orders at which each place of the bearing would be struck. `FaultOrderClassifier` names the
place from them. The recording is one of HIT-SM, if it is at hand; otherwise it is simulated.
"""

import matplotlib.pyplot as plt

from skarxlag import make_fault_order_classifier
from skarxlag.datasets import fetch_hit_sm, simulate_rig
from skarxlag.plotting import EnvelopeSpectrumDisplay

# %%
# A recording of an outer race, cut into rows of a second or more. Nothing is known of it but the
# bearing and the nominal speed.
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
# The classifier stands behind a model of the signal, which is fitted on the rows that are to be
# diagnosed.
classifier = make_fault_order_classifier(bearing="6205", sampling_rate=rig.sampling_rate).fit(rows)
print("places:", classifier.predict(rows, rpm=rpm).tolist())
print("p-values:", classifier.p_values(rows, rpm=rpm).round(5).tolist())

# %%
# The evidence: the contrast of the envelope spectra, and the comb that was found.
EnvelopeSpectrumDisplay.from_estimator(classifier, rows[0], rpm=rpm)
plt.show()
