"""Why diagnosis across speeds works where it does: spectra, drift, poles, evidence, adaptation.

Run ``python -m benchmarks.recipe speed-effects`` from the root of the repository.
Descriptions of a rig use all its windows; scores keep to the protocol of `benchmarks.cross_speed`.
Nothing here enters a default.
"""

import pandas as pd

from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.evidence_over_time import (
    adaptation_rows,
    amplitude_row,
    correlation_row,
    evidence_table,
    log_rms,
    speed_pairs,
)
from benchmarks.recipe.options import options, rigs
from benchmarks.recipe.spectral_drift import (
    best_poles,
    drift_table,
    mean_square_distance,
    mean_square_move,
    moments,
    pole_table,
    valley_table,
)

TEXT = {
    "valleys": "Windows of unit RMS, log of Welch's estimate, its bins ordered by mean level. Mean "
    "squares in nepers² of power: difference between two conditions at one speed, change of a "
    "condition from one speed to another, difference between two windows. Then accuracy of linear "
    "discriminant analysis on these bins alone.",
    "drift": "Cepstra of the windows' colour (autoregressive model of order 128), mean squares for "
    "one coefficient n in nepers² of power: change of a condition between two speeds, what "
    "`SpectralDistance` expects of it, the share that is the same for all conditions (their "
    "mean change), scatter of windows, difference between two conditions.",
    "best poles": 'Bank of models, one for each condition, `pole="optimise"`: the output\'s pole '
    "and the mean squared innovation it saves.",
    "poles": "Bank of order 32, innovations evaluated without an observer.",
    "amplitude": "Log power of windows in the sensor's unit: mean squares as above. Then accuracy "
    "at other speeds of the squared residual plus (level - mean level of the condition)² / "
    "(scatter + drift variance), by the drift variance in nepers² of power.",
    "evidence": "Log-probabilities of consecutive windows added up, at the other speeds; and of "
    "as many windows drawn anywhere from one recording.",
    "correlation": "Being right, at the other speeds, between a window and the next. A recording "
    "counts once for each training speed.",
    "adaptation": "Healthy first halves at the new speed move all references; accuracy at the "
    "other speeds.",
}


def level_row(rig):
    """Mean squares of the log power of windows, in the sensor's unit."""
    means, within, noise = moments(log_rms(rig.data)[:, None], rig.target, rig.rpm)
    return {
        "between conditions": mean_square_distance(means)[0],
        "between speeds": mean_square_move(means, noise)[0][0],
        "windows": 2 * within[0],
    }


def tables(rig, window_length):
    """Every table of one rig, by name."""
    pairs = list(speed_pairs(rig, window_length))
    return {
        "valleys": valley_table(rig, window_length),
        "drift": drift_table(rig, window_length),
        "best poles": best_poles(rig, window_length),
        "poles": pole_table(rig, window_length),
        "amplitude": pd.DataFrame([{**level_row(rig), **amplitude_row(pairs)}]),
        "evidence": evidence_table(pairs),
        "correlation": pd.DataFrame([correlation_row(pairs)]),
        "adaptation": pd.DataFrame(adaptation_rows(pairs)),
    }


def block(name, by_rig):
    """Markdown of one table for all rigs; short ones are put under each other in one."""
    parts = [TEXT[name]]
    if all(len(frame) == 1 for frame in by_rig.values()):
        joined = pd.concat(by_rig, names=["rig", None]).reset_index("rig")
        return "\n\n".join([*parts, markdown(joined)])
    for label, frame in by_rig.items():
        parts += [f"**{label}**", markdown(frame)]
    return "\n\n".join(parts)


def main(arguments=None):
    chosen = options(__doc__, "understanding", arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    found = {label: tables(rig, chosen.window_length) for label, rig in rigs(chosen)}
    blocks = {}
    for name in TEXT:
        by_rig = {label: each[name] for label, each in found.items()}
        joined = pd.concat(by_rig, names=["rig", None]).reset_index("rig")
        joined.to_csv(chosen.output / f"{name.replace(' ', '_')}.csv", index=False)
        blocks[name] = block(name, by_rig)
    publish(chosen, blocks)
