"""
Does identification recover a known system?
===========================================

An ARX system with known coefficients is driven by a random input. With its pole at 0 an
ARX-Laguerre model *is* an ARX model, so identification must return these coefficients.
With a pole that fits the dynamics of the system, few filters replace many lags.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lfilter

from skarxlag import ARXLaguerre

# %%
# y(k) = 1.5 y(k-1) - 0.7 y(k-2) + 0.5 u(k-1) + 0.3 u(k-2) + noise(k)
rng = np.random.default_rng(0)
u, noise = rng.normal(size=(2, 60_000))
y = lfilter([0, 0.5, 0.3], [1, -1.5, 0.7], u) + lfilter(
    [1], [1, -1.5, 0.7], 0.1 * noise
)
windows = np.stack([y.reshape(-1, 1200), u.reshape(-1, 1200)], axis=1)

model = ARXLaguerre(order=2, pole=0.0).fit(windows)
print("true coefficients      ", [1.5, -0.7, 0.5, 0.3])
print("identified coefficients", model.coef_[0].round(3).tolist())

# %%
# The fit of a one-step prediction with and without the input shows the effect of the
# input.
without = ARXLaguerre(order=2, pole=0.0).fit(windows[:, 0])
print(f"fit with the input    {model.fit_percentage(windows).mean():5.1f} %")
print(f"fit without the input {without.fit_percentage(windows[:, 0]).mean():5.1f} %")

# %%
# The second system is slow and is simulated from its input. Past outputs have little
# effect, because their network has a single filter. Eight lags of the input are too
# few, but eight filters with a searched pole are sufficient.
slow = lfilter([0, 1], [1, -1.8, 0.82], u)
slow_windows = np.stack([slow.reshape(-1, 1200), u.reshape(-1, 1200)], axis=1)
shown = slice(400, 600)
_, ax = plt.subplots(layout="constrained")
for pole, style in ((0.0, ":"), ("optimise", "--")):
    model = ARXLaguerre(order=[1, 8], pole=[0.0, pole]).fit(slow_windows)
    fit = model.fit_percentage(slow_windows, free_run=True).mean()
    print(
        f"pole of the input's network {model.poles_[1]:.3f}: simulation fits {fit:5.1f} %"
    )
    simulated = model.predict_output(slow_windows[:1], free_run=True)[0, 0]
    name = f"eight filters, pole {model.poles_[1]:.2f}"
    ax.plot(simulated[shown], linestyle=style, label=name, zorder=3)
    measured = slow_windows[0, 0, -len(simulated) :]
    ax.plot(measured[shown], color="grey", label="system" if pole == 0.0 else None)
ax.set(xlabel="Sample", ylabel="Output")
ax.legend()
plt.show()
