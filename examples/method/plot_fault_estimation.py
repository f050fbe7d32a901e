"""
Where does the extended state help?
===================================

A step of known size enters the difference equation of a healthy bearing's output. Three
observers estimate this step: the extended-state observer, whose gain grows with the
fault; the linear observer with the same small-signal gain; and the linear observer with
twice that gain. Without a fault, the first estimate has as little noise as the second.
It settles faster for larger faults.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lfilter

from skarxlag import ARXLaguerre, ExtendedStatePIObserver, PIObserver
from skarxlag.datasets import simulate_rig

POLE = 0.3
observers = {
    "extended state": ExtendedStatePIObserver(pole=POLE, ki=0.05, n_observers=1),
    "linear, same gain": PIObserver(pole=POLE, kp=0.1, ki=0.05),
    "linear, twice the gain": PIObserver(pole=POLE, kp=0.1, ki=0.1),
}

# %%
# The observers receive innovations of a healthy model on windows that were not used for
# its identification, with an output of unit RMS. The fault adds to them through 1 / (z
# - pole).
rig = simulate_rig(rpm=500, conditions="Normal", n_samples=120_000)
model = ARXLaguerre(pole=POLE).fit(rig.data[:50])
healthy = model.transform(rig.data[50:])[:, 0]
n_samples = healthy.shape[-1]
onset = n_samples // 2
after = np.arange(n_samples) >= onset


def estimates(observer, innovations, size):
    """Compute fault estimates with a step of this size at the onset."""
    seen = innovations + lfilter([0, 1], [1, -POLE], size * after)
    return observer.fit(seen).observe(seen).fault_estimate


def settling_time(observer, size):
    """Count samples until the estimate without noise stays within 5 % of the step."""
    path = estimates(observer, np.zeros((1, n_samples)), size)[0, onset:]
    return int(np.flatnonzero(np.abs(path - size) > 0.05 * size)[-1]) + 1


# %%
print("simulated rig; faults in units of the output's RMS")
sizes = (0.1, 0.5, 1.0, 2.0, 5.0)
print("samples until settled at a fault of", *(f"{size:6}" for size in sizes))
for name, observer in observers.items():
    times = [settling_time(observer, size) for size in sizes]
    print(f"{name:34}", *(f"{time:6}" for time in times))

print("noise of the estimate (standard deviation) and bias at a fault of 1")
settled = slice(onset + 200, None)
for name, observer in observers.items():
    quiet = estimates(observer, healthy, 0.0)[:, settled]
    faulty = estimates(observer, healthy, 1.0)[:, settled]
    print(
        f"{name:24} healthy {quiet.std():.3f}  faulty {faulty.std():.3f}  "
        f"bias {faulty.mean() - 1:+.0e}"
    )

# %%
_, ax = plt.subplots(layout="constrained")
for name, observer in observers.items():
    ax.plot(estimates(observer, healthy[:1], 2.0)[0], label=name, linewidth=0.9)
ax.plot(2.0 * after, color="black", linestyle="--", linewidth=0.9, label="fault")
ax.set(xlim=(onset - 50, onset + 150), xlabel="Sample", ylabel="Fault estimate")
ax.legend()
plt.show()
