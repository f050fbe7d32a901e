"""
Can the size of a crack be estimated?
=====================================

A standard regressor learns the size of a crack from residual levels and levels of fault
estimates, at one shaft speed, and is tested at another. It is compared with two
baselines: the median crack size, and the same regressor on the level of the window
alone. All data are simulated. The errors show how the result depends on the input, but
they are no evidence about a real machine.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.dummy import DummyRegressor
from sklearn.ensemble import RandomForestRegressor
from sklearn.metrics import mean_absolute_error

from skarxlag import ARXLaguerre, PIObserver
from skarxlag.datasets import simulate_rig

# %%
# The data have six crack sizes of three single faults, and the healthy bearing as size
# 0. A window lasts 4.8 ms and mostly contains no impact, so the estimate relies on
# rubbing at the crack.
rig = simulate_rig(
    rpm=(400, 500),
    crack_mm=(1, 2, 3, 4, 5, 6),
    conditions=("Normal", "IR", "OR", "Ball"),
    n_samples=24_000,
)
train, test = rig.rpm == 500, rig.rpm == 400
crack_mm = rig.crack_mm


# %%
# All features are logarithms of RMS values. A bank has one model for each condition at
# the training speed, and processes windows scaled to unit RMS. One healthy model in the
# unit of the sensor keeps the amplitude.
def observed(*, fault_estimate, **identification):
    """Compute the levels of an observer that is fitted at the training speed."""
    identify, observer = ARXLaguerre(**identification), PIObserver()
    innovations = identify.fit(rig.data[train], rig.target[train]).transform(rig.data)
    levels = observer.fit_transform(innovations)
    if fault_estimate:
        estimates = observer.observe(innovations).fault_estimate
        levels = np.hstack([levels, np.sqrt(np.mean(estimates**2, axis=2))])
    return np.log(levels)


healthy = {"healthy": "Normal", "unit_rms": False}
features = {
    "level of the window": np.log(rig.data[:, :1].std(axis=2)),
    "healthy model, residual": observed(fault_estimate=False, **healthy),
    "healthy model, residual and fault estimate": observed(
        fault_estimate=True, **healthy
    ),
    "bank, residuals": observed(fault_estimate=False),
    "bank, residuals and fault estimates": observed(fault_estimate=True),
}

# %%
# The program prints mean absolute errors at the other speed. All emission increases
# with the speed, so features that keep the amplitude are worse than the median crack.
# The bank compares a window with each condition, and a common change of all levels
# cancels. Levels of fault estimates do not help here: the integrator of the observer is
# far slower than the resonances that a crack excites.
errors, predicted = {}, {}


def score(name, regressor, rows):
    """Fit at the training speed, and store predictions and error at the other."""
    predicted[name] = regressor.fit(rows[train], crack_mm[train]).predict(rows[test])
    errors[name] = mean_absolute_error(crack_mm[test], predicted[name])


score(
    "median crack", DummyRegressor(strategy="median"), features["level of the window"]
)
for name, rows in features.items():
    score(name, RandomForestRegressor(random_state=0), rows)
print("simulated rig, trained at 500 rpm, tested at 400 rpm; mean absolute error in mm")
for name, error in errors.items():
    print(f"{name:44}{error:5.2f}")

# %%
# Small cracks are overestimated and large ones underestimated. This is usual for
# regression on overlapping features.
shown = ("level of the window", "bank, residuals")
sizes = np.unique(crack_mm)
figure, axes = plt.subplots(1, 2, sharey=True, layout="constrained", figsize=(8, 3.6))
for ax, name in zip(axes, shown, strict=True):
    by_size = [predicted[name][crack_mm[test] == size] for size in sizes]
    ax.boxplot(by_size, positions=sizes, widths=0.6, whis=(5, 95), showfliers=False)
    ax.plot(sizes, sizes, color="#0072B2", linewidth=1)
    ax.set(title=f"{name}: {errors[name]:.2f} mm", xlabel="Crack (mm)")
axes[0].set_ylabel("Predicted at 400 rpm (mm)")
plt.show()
