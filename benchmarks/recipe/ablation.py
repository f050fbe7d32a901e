"""Effect of each part of a diagnoser: variants paired over speed pairs and rigs.

Run ``python -m benchmarks.recipe ablation`` from the root of the repository. The
protocol is that of `benchmarks.cross_speed`. A variant is the recipe with one part
changed. The recipe was fixed before; nothing here chooses it.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.command import run
from benchmarks.cross_speed.peers import LabelsOnly, unit_rms
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.options import options, rigs
from benchmarks.recipe.parts import OVERVIEW, PROPOSAL, RECIPE, WITHOUT, part_table
from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    LogSpectra,
    PIObserver,
    ThresholdLadder,
    make_diagnoser,
)
from skarxlag.core.fault_locations import location_of_label
from skarxlag.models.residual_evaluations import RESIDUAL_EVALUATIONS

EVALUATIONS = {name: name.replace("_", " ") for name in RESIDUAL_EVALUATIONS}
OBSERVERS = {
    "no observer": partial(PIObserver, kp=0.0, ki=0.0),  # e is the innovation itself
    "linear": PIObserver,
    "extended state": partial(ExtendedStatePIObserver, n_observers=1),
}
UNITS = ("unit RMS", "sensor's unit")
#: A rough drift must be above 0; this one is far below the scatter of windows.
TINY = 1e-6
NO_DRIFT = {"smooth_drift": 0.0, "rough_drift": TINY, "frequency_drift": 0.0}


@dataclass(kw_only=True, eq=False, repr=False)
class OneGroup(LogSpectra):
    """One of the groups of `LogSpectra`."""

    group: int

    def transform(self, X):
        """Compute the group of each window, as an array of shape (n_windows, 1, n_bands)."""
        return super().transform(X)[:, [self.group]]


#: Changed steps and parameters between the model of `make_diagnoser` and its decision.
PARTS = {
    "spectral shape alone": {"measure": OneGroup(group=0)},
    "impulsiveness alone": {"measure": OneGroup(group=1)},
    "smooth drift 0": {"compare__smooth_drift": 0.0},
    f"rough drift {TINY:g}": {"compare__rough_drift": TINY},
    "frequency drift 0": {"compare__frequency_drift": 0.0},
    "no drift at all": {f"compare__{name}": value for name, value in NO_DRIFT.items()},
    "spectrum order 64": {"measure__spectrum_order": 64},
}
MODELS = ("measured inputs left out", "plain windows, no model", "model order 32")
#: The paper's proposal as its printed equations suggest it.
ONE_OBSERVER = "extended state, switching gain"


def observing(observer, healthy, **identification):
    return make_pipeline(
        ARXLaguerre(**identification), observer, ThresholdLadder(healthy=healthy)
    )


def comparing(healthy, *, model=None, **windows):
    """The recommended diagnoser with some parameters changed."""
    diagnoser = make_diagnoser(healthy=healthy)
    diagnoser["identify"].set_params(**model or {})
    diagnoser["decide"].residual.set_params(**windows)
    return diagnoser


def output_alone(healthy):
    return make_pipeline(FunctionTransformer(unit_rms), *_steps(healthy))


def plain_windows(healthy):
    return make_pipeline(FunctionTransformer(unit_rms), *_steps(healthy)[1:])


def _steps(healthy):
    return [step for _, step in comparing(healthy).steps]


def healthy_alone(healthy, *, unit):
    identify = ARXLaguerre(healthy=healthy, unit_rms=unit == "unit RMS")
    return make_pipeline(identify, PIObserver(), ThresholdLadder(healthy=healthy))


def verdicts_only(make, healthy):
    """Classifier without probabilities, which would cost every transform once more."""
    return LabelsOnly(make(healthy))


def variants():
    """Functions from the healthy condition to a classifier, by name."""
    makers = {}
    for observer, make in OBSERVERS.items():
        for evaluation, words in EVALUATIONS.items():
            makers[f"{observer}, {words}"] = partial(
                observing, make(evaluation=evaluation)
            )
    bank = ExtendedStatePIObserver()
    linear = ExtendedStatePIObserver(saturation=0.0)
    makers[PROPOSAL] = partial(observing, bank)
    makers[f"{PROPOSAL}, linear observers"] = partial(observing, linear)
    makers[f"{PROPOSAL}, model order 8"] = partial(observing, bank, order=8)
    makers[f"{PROPOSAL}, one model"] = partial(observing, bank, bank=False)
    makers[RECIPE] = comparing
    makers[f"{RECIPE}, measured inputs left out"] = output_alone
    makers[f"{RECIPE}, plain windows, no model"] = plain_windows
    makers[f"{RECIPE}, model order 32"] = partial(comparing, model={"order": 32})
    for name, windows in PARTS.items():
        makers[f"{RECIPE}, {name}"] = partial(comparing, **windows)
    for unit in UNITS:
        makers[f"healthy model alone, {unit}"] = partial(healthy_alone, unit=unit)
    return makers


def comparisons():
    """Question, variant, and what it is compared with."""
    asked = []
    for words in EVALUATIONS.values():
        asked.append(
            (
                "observer against innovations",
                f"linear, {words}",
                f"no observer, {words}",
            )
        )
    for words in EVALUATIONS.values():
        asked.append(
            (
                "extended state against linear",
                f"extended state, {words}",
                f"linear, {words}",
            )
        )
    for observer in OBSERVERS:
        for words in ("switching gain", "whiteness"):
            asked.append(
                (
                    "evaluation against power",
                    f"{observer}, {words}",
                    f"{observer}, power",
                )
            )
    asked.append(("bank over frequency against one observer", PROPOSAL, ONE_OBSERVER))
    asked.append(
        ("bank over frequency against the baseline", PROPOSAL, "linear, power")
    )
    for name in ("linear observers", "model order 8", "one model"):
        asked.append(("a part of the proposal", f"{PROPOSAL}, {name}", PROPOSAL))
    asked.append(("recommended against the proposal", RECIPE, PROPOSAL))
    for unit in UNITS:
        asked.append(
            (
                "one model against the bank",
                f"healthy model alone, {unit}",
                "linear, power",
            )
        )
    for name in MODELS:
        asked.append(("model before the measures", f"{RECIPE}, {name}", RECIPE))
    for name in PARTS:
        asked.append(
            ("a part of the recommended diagnoser", f"{RECIPE}, {name}", RECIPE)
        )
    return asked


def difference(variant, reference):
    """Mean of the paired differences and its standard error over the pairs of speeds.

    Pairs share training sets and test sets, so they are not independent, and the error
    is rather too small.

    Parameters
    ----------
    variant, reference : Series
        Accuracies, indexed by pair of speeds.

    Returns
    -------
    mean, standard_error : float

    Examples
    --------
    >>> difference(pd.Series([0.5, 0.9]), pd.Series([0.4, 0.6]))
    (0.2, 0.1)
    """
    paired = (variant - reference).to_numpy()
    if np.isnan(paired).any():
        raise ValueError("the variants were not scored on the same pairs of speeds.")
    error = paired.std(ddof=1) / np.sqrt(len(paired)) if len(paired) > 1 else np.nan
    return round(float(paired.mean()), 12), round(float(error), 12)


def accuracies(pairs):
    """Table of mean and worst pair: a row for each variant, two columns for each rig."""
    cross = pairs[(pairs.train_rpm != pairs.test_rpm) & (pairs.verdict == "window")]
    grouped = cross.groupby(["method", "rig"]).accuracy
    variants = cross.method.unique()
    mean, worst = (
        score.unstack().loc[variants] for score in (grouped.mean(), grouped.min())
    )
    table = pd.DataFrame({"variant": variants})
    for rig in cross.rig.unique():
        table[f"{rig}: mean"] = mean[rig].to_numpy()
        table[f"{rig}: worst pair"] = worst[rig].to_numpy()
    return table


def differences(pairs):
    """Rows of question, variant, reference, rig, mean difference and its standard error."""
    cross = pairs[(pairs.train_rpm != pairs.test_rpm) & (pairs.verdict == "window")]
    by_pair = cross.set_index(["rig", "method", "train_rpm", "test_rpm"]).accuracy
    rows = []
    for question, variant, reference in comparisons():
        for rig in cross.rig.unique():
            scores = by_pair[rig]
            if {variant, reference} <= set(scores.index.get_level_values("method")):
                mean, error = difference(scores[variant], scores[reference])
                rows.append((question, variant, reference, rig, mean, error))
    columns = [
        "question",
        "variant",
        "reference",
        "rig",
        "difference",
        "standard_error",
    ]
    return pd.DataFrame(rows, columns=columns)


def difference_table(rows):
    """A row for each comparison, a column for each rig and one for the mean over rigs."""
    lines = []
    for (question, variant, reference), group in rows.groupby(
        ["question", "variant", "reference"], sort=False
    ):
        line = {"question": question, "variant": variant, "minus": reference}
        for row in group.itertuples():
            line[row.rig] = f"{row.difference:+.3f} ± {row.standard_error:.3f}"
        error = np.sqrt((group.standard_error**2).sum()) / len(group)
        line["mean over rigs"] = f"{group.difference.mean():+.3f} ± {error:.3f}"
        lines.append(line)
    return pd.DataFrame(lines)


def report(pairs):
    """Markdown of both tables."""
    rows = differences(pairs)
    return (
        "Accuracy of single windows at the speeds that a variant was not fitted at: mean over "
        "ordered pairs of speeds, worst pair.\n\n"
        "**Accuracy**\n\n"
        f"{markdown(accuracies(pairs))}\n\n"
        "Paired differences in accuracy, variant minus reference, mean ± standard error over the "
        "ordered pairs of speeds of a rig. Pairs share training and test windows, so the standard "
        "errors are rather too small.\n\n**Differences**\n\n"
        f"{markdown(difference_table(rows))}"
    )


def healthy_condition(rig):
    """Return the healthy condition of a rig, None if it has none."""
    return next(
        (name for name in rig.target_names if location_of_label(name) == "healthy"),
        None,
    )


def variants_of(rig, parts_alone=False):
    """Yield name and classifier of the variants that a rig is scored with.

    A variant with a model of the healthy condition needs a rig that has one.

    Parameters
    ----------
    rig : Bunch
        Windows of a rig.
    parts_alone : bool, default=False
        Whether to leave out what the table of parts does not show.
    """
    healthy = healthy_condition(rig)
    for name, make in variants().items():
        is_part = name == RECIPE or name in WITHOUT.values()
        needs_healthy = name.startswith("healthy model")
        if (is_part or not parts_alone) and not (needs_healthy and healthy is None):
            yield name, partial(verdicts_only, make, healthy)


def main(arguments=None):
    """Run the command."""
    chosen = options(__doc__, "ablation", arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    all_variants = chosen.window_length[0]
    for length in chosen.window_length:
        for label, rig in rigs(chosen, length):
            for name, classifier in variants_of(
                rig, parts_alone=length != all_variants
            ):
                if not (
                    chosen.resume
                    and reporting.has_run(chosen.output, label, length, name)
                ):
                    run(label, rig, name, classifier, length, chosen.output)
    pairs = pd.read_csv(chosen.output / "pairs.csv")
    pairs = pairs[pairs.window_length == all_variants]
    differences(pairs).to_csv(chosen.output / "differences.csv", index=False)
    recordings = pd.read_csv(chosen.output / "recordings.csv")
    publish(chosen, {OVERVIEW: part_table(recordings), "ablation": report(pairs)})
