"""
How large is a crack when the alarm is raised?
==============================================

A simulated bearing runs to failure while its speed changes: a crack grows from nothing
to 3 mm. The detector was calibrated on the healthy bearing at four speeds, none of
which is that of the run.
"""

import matplotlib.pyplot as plt
import numpy as np

from skarxlag import make_detector
from skarxlag.datasets import simulate_rig

# %%
# The detector is fitted on healthy recordings at four speeds. A row lasts 0.19 s.
RATE, LENGTH = 0.02, 48_000
healthy = simulate_rig(
    rpm=(300, 400, 500, 600),
    conditions="Normal",
    crack_mm=1,
    n_samples=13 * LENGTH,
    window_length=LENGTH,
)
detector = make_detector(false_alarm_rate=RATE).fit(healthy.data, rpm=healthy.rpm)

# %%
# The run lasts forty weeks, with one recording in each, at another speed. The first ten
# weeks are healthy. Then the crack grows by the same factor every week. Each
# recording has new noise.
weeks = np.arange(40)
crack_mm = np.where(weeks < 10, 0.0, 0.2 * 15.0 ** ((weeks - 10) / 29))
speeds = np.random.default_rng(0).uniform(320, 580, len(weeks)).round()


def row(condition, week):
    """Simulate the recording of a week, which is healthy before the tenth."""
    rig = simulate_rig(
        rpm=speeds[week],
        conditions=condition if crack_mm[week] > 0 else "Normal",
        crack_mm=max(crack_mm[week], 0.1),
        n_samples=LENGTH,
        window_length=LENGTH,
        random_state=int(week) + 1,
    )
    return rig.data[0]


# %%
# The alarm is raised when three of five rows in a row are flagged.
fig, ax = plt.subplots(layout="constrained", figsize=(7, 4))
for condition, marker in (("OR", "o"), ("Ball", "s"), ("IR", "^")):
    p_values = detector.p_values(
        np.stack([row(condition, week) for week in weeks]), rpm=speeds
    )
    flagged = np.convolve(p_values < RATE, np.ones(5))[: len(weeks)]
    alarm = next((week for week in weeks if flagged[week] > 2.5), None)
    (line,) = ax.plot(weeks, p_values, marker=marker, markersize=4, label=condition)
    if alarm is None:
        print(f"{condition}: no alarm up to {crack_mm[-1]:.1f} mm")
        continue
    ax.axvline(alarm, color=line.get_color(), linestyle=":")
    print(f"{condition}: alarm at week {alarm}, crack of {crack_mm[alarm]:.1f} mm")
ax.axhline(RATE, color="black", linestyle="--", linewidth=1)
ax.set(yscale="log", xlabel="week", ylabel="p-value; dashed: stated rate")
ax.legend(loc="lower left", title="dotted: alarm")
size = ax.twinx()
size.fill_between(weeks, crack_mm, color="gray", alpha=0.25, linewidth=0)
size.set(ylabel="crack, mm (grey)", ylim=(0, 10))
plt.show()
