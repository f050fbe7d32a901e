import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.cross_speed.peers_with_speed import SpectrumWithSpeed
from benchmarks.recipe import targets
from benchmarks.recipe.rigs import Recording, Rig

LENGTH = 1200


def recordings(angle_of):
    """Recordings of two conditions at three speeds, each with one resonance."""
    rng = np.random.default_rng(0)
    found = []
    for rpm in (600.0, 900.0, 1200.0):
        for condition in ("a", "b"):
            angle = angle_of(condition, rpm)
            poles = 0.9 * np.exp(1j * angle * np.array([1, -1]))
            noise = rng.standard_normal(16 * LENGTH)
            samples = lfilter([1.0], np.poly(poles).real, noise)
            found.append(Recording(samples, condition, rpm))
    return found


@pytest.fixture(scope="module")
def rig():
    return Rig(
        "mine",
        4000.0,
        recordings(lambda condition, rpm: {"a": 0.5, "b": 1.5}[condition]),
    )


@pytest.mark.parametrize("method", [*targets.PEERS, *targets.WITH_SPEED])
def test_peers_name_conditions_that_do_not_depend_on_the_speed(rig, method):
    found = targets.verdicts(rig, "windows of 1200", method)
    # Three training speeds with two other ones each, and the other way round; 16
    # windows at each.
    assert len(found) == (3 * 2 + 3) * 16
    # With orders, the resonances move with the speed.
    least = 0.4 if "orders" in method else 0.95
    assert found.right.mean() > least


def test_orders_of_the_shaft_are_compared_at_another_speed():
    scaled = recordings(
        lambda condition, rpm: {"a": 1.0, "b": 1.3}[condition] * rpm / 1200
    )
    rig = Rig("scaled", 4000.0, scaled)
    right = {
        method: targets.verdicts(rig, "windows of 1200", method).right.mean()
        for method in targets.WITH_SPEED
    }
    as_feature, over_orders = right.values()
    assert over_orders > 0.95 > as_feature


def test_the_speed_is_a_feature():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, LENGTH))
    rpm = np.repeat([600, 1200], 20)
    y = np.repeat(["a", "b"], 20)
    fitted = SpectrumWithSpeed().fit(X, y, rpm)
    assert (fitted.predict(X, rpm) == y).mean() > 0.9
    assert (fitted.predict(X, 600) != fitted.predict(X, 1200)).any()


def test_the_command_prints_the_share_of_right_verdicts(
    rig, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(targets, "real_rigs", lambda *options: [rig])
    method = "log spectrum + shrinkage LDA"
    options = ["--rig", "mine", "--rows", "windows of 1200", "--output", str(tmp_path)]
    targets.main([*options, "--method", method, targets.STATED])
    line = f"| windows of 1200 | one speed | {method} | 1.000 | 1.000 |"
    assert line in capsys.readouterr().out
