"""
What do the paper's figures look like?
======================================

This example draws Figures 7, 8 and 10-19 of Piltan and Kim (2019) for the simulated
rig. The Display classes show the prediction of the model, the residual of the observer,
and the thresholds. All signals are simulated, because the paper's own data were never
published.
"""

import matplotlib.pyplot as plt
from sklearn.pipeline import make_pipeline

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    ThresholdLadder,
    make_extended_state_pio,
)
from skarxlag.datasets import simulate_rig
from skarxlag.plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    ThresholdLadderDisplay,
    condition_styles,
)

# %%
# The figures show eight conditions at 500 rpm, with a crack of 6 mm. The first halves
# of the recordings are for calibration, and the second halves are shown. Each condition
# has the same colour in every figure.
rig = simulate_rig(rpm=500, crack_mm=6, n_samples=60_000)
names = rig.target_names
is_first = rig.start < 30_000
X, y = rig.data[~is_first], rig.target[~is_first]
window = {name: X[y == name][0] for name in names}

# %%
# Figure 10: raw signals ---------------------- Impacts are clearly visible if the outer
# ring is damaged. Most windows of 1200 samples contain none.
figure, axes = plt.subplots(
    len(names), sharex=True, sharey=True, figsize=(8, 8), layout="constrained"
)
for ax, name in zip(axes, names, strict=True):
    signal = rig.data[rig.target == name][:, 0].ravel()
    ax.plot(signal, linewidth=0.3, color=condition_styles(names)[name]["color"])
    ax.set_title(name, loc="left", fontsize="small")
axes[-1].set_xlabel("Sample")
figure.suptitle("Simulated rig, 500 rpm, crack 6 mm: acoustic emission in V")
plt.show()

# %%
# Figures 7 and 8: identification ------------------------------- The paper's ladder
# requires one model of the healthy condition, with its innovations in the unit of the
# sensor. The figure shows the first 320 samples of a window.
ladder = make_pipeline(
    ARXLaguerre(healthy="Normal", unit_rms=False),
    ExtendedStatePIObserver(n_observers=1),
    ThresholdLadder(healthy="Normal"),
)
ladder.fit(rig.data[is_first], rig.target[is_first])
for name in ("Normal", "IR-OR-Ball"):
    display = IdentificationDisplay.from_estimator(
        ladder,
        window[name][:, :320],
        condition=name,
        conditions=names,
        sampling_rate=rig.sampling_rate,
    )
    display.figure_.suptitle(f"Simulated rig: window of {name}")
    print(f"{name}: fit {display.fit_percentage:.1f} %")
plt.show()

# %%
# Figure 11: detection -------------------- The figure shows levels of the residual of
# the healthy model, and the threshold that one healthy window in a hundred may exceed.
display = ThresholdLadderDisplay.from_estimator(
    ladder, X, y, decision="detection", conditions=names
)
display.ax_.set_title("Simulated rig, 500 rpm: detection")
plt.show()

# %%
# The same levels on all rungs of the ladder: the band that contains the level
# determines the condition. Neighbours are confused if their levels overlap.
display = ThresholdLadderDisplay.from_estimator(ladder, X, y, conditions=names)
display.ax_.set_title(
    f"Simulated rig, 500 rpm: {ladder.score(X, y):.0%} of verdicts are right"
)
plt.show()

# %%
# Figures 12-19: residual and thresholds -------------------------------------- The
# figures are in the order of the paper. The residual has the sign of the sliding
# surface. Its size is the adapted gain, which settles at the level that is compared
# with the ladder.
paper_order = [
    "Normal",
    "Ball",
    "IR",
    "OR",
    "IR-Ball",
    "OR-Ball",
    "IR-OR",
    "IR-OR-Ball",
]
for number, name in enumerate(paper_order, start=12):
    figure, ax = plt.subplots(figsize=(8, 3), layout="constrained")
    ResidualDisplay.from_estimator(
        ladder, window[name], condition=name, conditions=names, ax=ax
    )
    figure.suptitle(f"Simulated rig: Figure {number} of the paper, {name}")
plt.show()

# %%
# A bank instead of a ladder -------------------------- With one model for each
# condition, the condition with the smallest residual is the verdict. The verdict is
# correct if the residual of the true condition is below that of the best other one.
bank = make_extended_state_pio(healthy="Normal").fit(
    rig.data[is_first], rig.target[is_first]
)
display = ThresholdLadderDisplay.from_estimator(bank, X, y, conditions=names)
display.ax_.set_title(
    f"Simulated rig, 500 rpm: {bank.score(X, y):.0%} of verdicts are right"
)
plt.show()
