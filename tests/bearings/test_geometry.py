import numpy as np
import pytest

from skarxlag.bearings import (
    BEARINGS,
    SKF_6205,
    BearingGeometry,
    bearing_orders,
    contact_speed,
    defect_frequencies,
)

# Rexnord ZA-2115, the bearing of the IMS run-to-failure data, inches turned into mm.
REXNORD_ZA2115 = BearingGeometry(
    n_elements=16,
    element_diameter=0.331 * 25.4,
    pitch_diameter=2.815 * 25.4,
    contact_angle=15.17,
)


def test_fault_orders_are_those_of_published_tables():
    orders = bearing_orders(SKF_6205)
    published = {
        "shaft": 1.0,
        "cage": 0.39828,
        "outer": 3.5848,
        "inner": 5.4152,
        "spin": 2.3567,
        "ball": 4.7135,
    }
    assert orders == pytest.approx(published, rel=1e-4)
    assert list(orders) == list(published)


def test_frequencies_at_2000_rpm_are_those_published_with_the_ims_data():
    frequencies = defect_frequencies(REXNORD_ZA2115, 2000.0)
    published = {"outer": 236.4, "inner": 296.9, "spin": 139.9, "cage": 14.7}
    for name, value in published.items():
        assert frequencies[name] == pytest.approx(value, abs=0.1)
    assert frequencies["ball"] == 2 * frequencies["spin"]


def test_the_elements_pass_the_two_rings_n_times_a_turn_together():
    frequencies = defect_frequencies(REXNORD_ZA2115, 1234.0)
    assert frequencies["outer"] + frequencies["inner"] == pytest.approx(
        16 * 1234.0 / 60
    )


def test_frequencies_take_an_array_of_speeds():
    outer = defect_frequencies(SKF_6205, np.array([300.0, 600.0]))["outer"]
    assert outer[1] == 2 * outer[0]


@pytest.mark.parametrize("surface", ["outer", "inner", "element"])
def test_contact_speed_is_the_same_along_every_surface(surface):
    bearing, rpm = SKF_6205, 450.0
    frequencies = defect_frequencies(bearing, rpm)
    # Turns a second of the contact point relative to the surface, and the surface's
    # diameter.
    rate, diameter = {
        "outer": (
            frequencies["cage"],
            bearing.pitch_diameter + bearing.element_diameter,
        ),
        "inner": (
            rpm / 60 - frequencies["cage"],
            bearing.pitch_diameter - bearing.element_diameter,
        ),
        "element": (frequencies["spin"], bearing.element_diameter),
    }[surface]
    assert contact_speed(bearing, rpm) == pytest.approx(np.pi * diameter * 1e-3 * rate)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_elements": 1}, "n_elements == 1, must be >= 2"),
        ({"n_elements": 8.5}, "n_elements must be an instance of int, not float"),
        ({"element_diameter": 40.0}, "element_diameter == 40.0, must be < 40.0"),
        ({"element_diameter": -1.0}, "element_diameter == -1.0, must be > 0"),
        ({"pitch_diameter": np.inf}, "pitch_diameter == inf, must be finite"),
        (
            {"pitch_diameter": "40"},
            "pitch_diameter must be an instance of float, not str",
        ),
        ({"contact_angle": 90.0}, "contact_angle == 90.0, must be < 90"),
    ],
)
def test_impossible_dimensions_are_refused(changes, message):
    dimensions = {"n_elements": 8, "element_diameter": 10.0, "pitch_diameter": 40.0}
    with pytest.raises((TypeError, ValueError), match=message):
        BearingGeometry(**(dimensions | changes))


def test_bearings_by_name_dimensions_and_orders_agree():
    by_name = bearing_orders("SKF 6205")
    assert by_name == bearing_orders(SKF_6205)
    assert bearing_orders("9,7.94,39.04,0") == by_name
    assert bearing_orders(BEARINGS["ER12K"]) == bearing_orders("er-12k")
    sheet = bearing_orders({"BPFO": by_name["outer"], "BPFI": by_name["inner"]})
    # A contact angle of 0: everything follows from the two races.
    assert sheet == pytest.approx(by_name)
    twice = bearing_orders("outer=3.585, inner=5.415, twice_spin=4.8, cage=0.4")
    assert (twice["spin"], twice["cage"]) == (2.4, 0.4)


@pytest.mark.parametrize(
    ("name", "published"),
    [  # Orders that SpectraQuest and Case Western Reserve University publish.
        ("ER-12K", {"outer": 3.048, "inner": 4.95, "cage": 0.381, "spin": 1.992}),
        ("6203", {"outer": 3.0530, "inner": 4.9469, "cage": 0.3817, "ball": 3.9874}),
    ],
)
def test_named_bearings_have_their_published_orders(name, published):
    orders = bearing_orders(name)
    for key, value in published.items():
        assert orders[key] == pytest.approx(value, rel=2e-3)


@pytest.mark.parametrize(
    ("bearing", "message"),
    [
        ("6299", "bearing '6299' is not known; expected one of 6203"),
        ("9,7.94", "expected one of"),
        ("1,7.94,39.04", "n_elements == 1, must be >= 2"),
        ("outer=3.585", "expected at least outer .BPFO. and inner .BPFI."),
        (
            {"outer": 5.4, "inner": 3.6},
            "inner == 3.6, expected above 5.4, the order of the outer",
        ),
        (
            {"outer": 3.6, "inner": 5.4, "BSF": 2.3},
            "Order == 'BSF', expected .* twice_spin",
        ),
        ({"outer": 3.6, "inner": 5.4, "gear": 2.3}, "Order == 'gear', expected"),
        ({"outer": -3.6, "inner": 5.4}, "order 'outer' == -3.6, must be > 0"),
    ],
)
def test_unknown_bearings_are_refused(bearing, message):
    with pytest.raises(ValueError, match=message):
        bearing_orders(bearing)


def test_another_type_is_no_bearing():
    with pytest.raises(TypeError, match="got 6205"):
        bearing_orders(6205)
