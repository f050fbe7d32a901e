import numpy as np
import pandas as pd
import pytest

from benchmarks.recipe import battery, random_rigs, sensitivity
from benchmarks.recipe.battery import CANDIDATES, IN_USE, SHOWN, Comparison, choose, confirmed


@pytest.fixture(scope="module", autouse=True)
def small():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(random_rigs, "WINDOWS_A_HALF", 4)
        yield


@pytest.mark.parametrize("family", random_rigs.FAMILIES)
def test_a_seed_draws_a_rig(family):
    rig = random_rigs.random_rig(family, 3, 400)
    again, other = (random_rigs.random_rig(family, seed, 400) for seed in (3, 4))
    np.testing.assert_array_equal(rig.data, again.data)
    assert not np.array_equal(rig.data[:1], other.data[:1])
    assert np.isfinite(rig.data).all() and rig.data.shape[-1] == 400
    assert len(np.unique(rig.rpm)) == 3 and rig.target_names[0] in ("healthy", "Normal")
    counts = pd.crosstab(rig.target, rig.rpm)
    assert (counts == 8).all(axis=None) and set(counts.index) == set(rig.target_names)
    assert rig.data.ndim == (3 if family == "emission and torque" else 2)


def test_perturbations_change_the_output_alone():
    windows = np.random.default_rng(0).normal(size=(2, 2, 300))
    changed = battery.perturbed(windows)
    assert len(changed) == 6
    for name, each in changed.items():
        np.testing.assert_array_equal(each[:, 1], windows[:, 1])
        assert not np.allclose(each[:, 0], windows[:, 0]), name
        np.testing.assert_array_equal(battery.perturbed(windows[:, 0])[name], each[:, 0])
    tone = np.sin(0.5 * np.arange(3000))[np.newaxis]
    slower = battery.perturbed(tone)["slower"][0, 100:-100]
    expected = np.sin(0.5 / 1.1 * np.arange(3000))[100:-100]
    np.testing.assert_allclose(slower, expected, atol=0.05)


def scores(**by_candidate):
    index = pd.MultiIndex.from_product([["a", "b"], [0, 1]], names=["family", "seed"])
    return pd.DataFrame(by_candidate, index).rename(columns={"used": IN_USE})


def test_the_rule_chooses_among_the_admissible():
    table = scores(
        used=[0.6, 0.6, 0.5, 0.5],
        tied=[0.7, 0.7, 0.59, 0.59],
        best=[0.7, 0.7, 0.6, 0.6],
        loses_on_a=[0.57, 0.57, 0.9, 0.9],
    )
    assert choose(table) == "tied"
    orders = table.rename(columns={"tied": "x, order 8", "best": "x, order 32"})
    assert choose(orders) == "x, order 32" and choose(orders, ["x, order 32"]) == "x, order 8"
    assert choose(table, ["tied"]) == "best"
    assert confirmed(table, "best") and not confirmed(table, "loses_on_a")
    np.testing.assert_allclose(battery.by_family(table).loc["best"], [0.7, 0.6])
    shown = battery.score_table(table).set_index("candidate")
    assert shown["least against the recipe in use"]["loses_on_a"] == pytest.approx(-0.03)


@pytest.mark.slow
def test_candidates_and_variants_are_fitted_and_scored():
    rig = random_rigs.random_rig("strikes", 0, 400)
    sources, variants = sensitivity.variants()
    few = {name: variants[name] for name in list(variants)[:2]} | {
        name: (CANDIDATES | SHOWN)[name] for name in (IN_USE, "extended bank, product")
    }
    found = battery.across_speeds(rig, few, sources)
    assert set(found.index) == set(few) and found.between(0, 1).all()
    assert battery.on_perturbed_blocks(rig, few, sources=sources).between(0, 1).all()
    fitted = Comparison(rig.data, rig.target, {"x": CANDIDATES[IN_USE]}, battery.SOURCES)
    assert fitted.accuracies(rig.data, rig.target)["x"] > 0.9


def test_every_variant_names_a_source():
    sources, variants = sensitivity.variants()
    assert {variant.source for variant in variants.values()} <= set(sources)


def test_change_table_compares_with_its_own_recipe():
    table = scores(recommended=[0.6] * 4, proposal=[0.5] * 4)
    table["proposal, x"] = [0.6, 0.6, 0.3, 0.3]
    rows = sensitivity.change_table(table.drop(columns=IN_USE, errors="ignore"))
    last = rows.iloc[-1]
    assert last["change"] == pytest.approx(-0.05) and last["on"] == "b"
    assert last["largest loss"] == pytest.approx(-0.2)
