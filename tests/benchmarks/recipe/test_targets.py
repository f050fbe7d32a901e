import numpy as np
from scipy.signal import lfilter

from benchmarks.recipe import targets
from benchmarks.recipe.rigs import Recording, Rig

LENGTH = 1200


def recordings(angle_of):
    """Recordings of two conditions at three speeds, each with one resonance."""
    rng = np.random.default_rng(0)
    of_conditions = []
    for rpm in (600.0, 900.0, 1200.0):
        for condition in ("a", "b"):
            angle = angle_of(condition, rpm)
            poles = 0.9 * np.exp(1j * angle * np.array([1, -1]))
            noise = rng.standard_normal(16 * LENGTH)
            samples = lfilter([1.0], np.poly(poles).real, noise)
            of_conditions.append(Recording(samples, condition, rpm))
    return of_conditions


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
