"""The catalogue of bearings: its sources, its consistency, and the names that it understands."""

import csv
from pathlib import Path

import numpy as np
import pytest

import skarxlag
from skarxlag.bearings import BEARINGS, BearingGeometry, bearing_orders

with (Path(skarxlag.__file__).parent / "bearings" / "catalogue.csv").open(
    encoding="utf-8"
) as file:
    ROWS = {row["name"]: row for row in csv.DictReader(file)}
RADIAL = {"deep-groove ball", "insert ball", "cylindrical roller"}
WITH_CONTACT_ANGLE = {"angular-contact ball", "tapered roller", "spherical roller"}
#: Orders of the outer and the inner race that another source publishes, or that follow
#: from the elements in another source, by bearing.
SECOND_SOURCES = [
    # Sehri et al. (2023), table 2: NSK 6203ZZ, 8 balls of 6.77 mm on 28.50 mm.
    ("6203", BearingGeometry(8, 6.77, 28.50)),
    # Lee, Kim and Kim (2024), table 2: MOCHU 6204.
    ("6204", BearingGeometry(8, 7.94, 34.57)),
    # Jung et al. (2023), table 1: NSK 6205.
    ("6205", BearingGeometry(9, 7.90, 38.5)),
    # Timken's table of inserts, of outer rings of the same size.
    ("6203", "203K"),
    ("6205", "205K"),
    ("6206", "206K"),
    ("6207", "207K"),
    ("6208", "208K"),
    ("6309", "309K"),
    # Apparatus of the PHM 2009 challenge: MB ER-10K, 8 balls of 0.3125 in on 1.319 in.
    ("ER10K", BearingGeometry(8, 0.3125, 1.319)),
    # Dimensions that fit the multipliers of the maker: 8 balls of 7.939 mm on 33.503
    # mm.
    ("ER12K", BearingGeometry(8, 7.939, 33.503)),
    # Huang and Baddour (2018): ER-16K.
    ("ER16K", BearingGeometry(9, 7.94, 38.52)),
    # Orders that are published with the MFPT data.
    ("NICE", {"outer": 3.245, "inner": 4.755}),
    # The NU 2205 has the rings of a NU 205.
    ("NU205", "NU2205"),
    # Frequencies in Hz at 2000 rpm that are published with the IMS data.
    ("ZA2115", {"outer": 236.4 * 60 / 2000, "inner": 296.9 * 60 / 2000}),
]


@pytest.mark.parametrize("name", ROWS)
class TestEveryBearing:
    def test_source_is_stated(self, name):
        assert len(ROWS[name]["source"]) > 20
        assert len(ROWS[name]["read_in"]) > 5
        assert ROWS[name]["type"] in RADIAL | WITH_CONTACT_ANGLE

    def test_orders_are_those_of_a_bearing(self, name):
        orders, n_elements = bearing_orders(name), int(ROWS[name]["elements"])
        # Sources round to two or three digits after the point.
        assert orders["outer"] + orders["inner"] == pytest.approx(n_elements, abs=3e-3)
        assert orders["cage"] == pytest.approx(orders["outer"] / n_elements, rel=0.01)
        assert (
            0.3
            < orders["cage"]
            < 0.5
            < 1
            < orders["spin"]
            < orders["outer"]
            < orders["inner"]
        )
        ratio = (orders["inner"] - orders["outer"]) / n_elements
        # A contact angle makes the elements larger than this ratio says.
        largest = (1 / ratio - ratio) / 2
        least = 0.75 if ROWS[name]["type"] in WITH_CONTACT_ANGLE else 0.99
        assert least * largest < orders["spin"] < 1.01 * largest

    def test_dimensions_are_those_of_a_bearing(self, name):
        bearing = BEARINGS[name]
        if isinstance(bearing, BearingGeometry):
            assert 3 <= bearing.element_diameter < bearing.pitch_diameter / 3
            # The elements fit on their circle, and leave about half of it empty at
            # most.
            circle = np.pi * bearing.pitch_diameter
            filled = bearing.n_elements * bearing.element_diameter / circle
            assert 0.45 < filled < 0.98

    def test_its_name_is_found(self, name):
        assert bearing_orders(name.lower()) == bearing_orders(BEARINGS[name])


@pytest.mark.parametrize(("name", "other"), SECOND_SOURCES)
def test_two_sources_agree_within_the_slip_of_a_bearing(name, other):
    one, two = bearing_orders(name), bearing_orders(other)
    assert one["outer"] == pytest.approx(two["outer"], rel=0.016)
    assert one["inner"] == pytest.approx(two["inner"], rel=0.016)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("6205-2RS", "6205"),
        ("6205-2Z/C3", "6205"),
        ("6205 C3", "6205"),
        ("6205/C3", "6205"),
        ("6205zz", "6205"),
        ("SKF 6205-2RS1/C3", "6205"),
        ("SKF 6205-2RSH/C3GJN", "6205"),
        ("skf6205-2RSJEM", "6205"),
        ("FAG 6205.2RSR.C3", "6205"),
        ("NSK 6203DDU", "6203"),
        ("6203LLU", "6203"),
        ("6206 N P5", "6206"),
        ("61806-2RS", "61806"),
        ("ER-16KCL", "ER16K"),
        ("MB ER-12K", "ER12K"),
        ("UC 204-12", "UC204"),
        ("uc205", "UC205"),
        ("NU 205 ECP", "NU205"),
        ("NU205", "NU205"),
        ("NU206-E-XL-TVP2", "NU206"),
        ("NU2205-E-XL-TVP2", "NU2205"),
        ("22205-E1-K-C3", "22205"),
        ("QJ 212 TVP", "QJ212"),
        ("ZA-2115", "ZA2115"),
        (" 6205 ", "6205"),
    ],
)
def test_makers_and_suffixes_do_not_matter(text, name):
    assert bearing_orders(text) == bearing_orders(BEARINGS[name])


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        ("6205 ETN9", "ETN9"),
        ("6205-B", "B"),
        ("6205-XYZ", "XYZ"),
        ("6205-2RS-E", "E"),
        ("UC204-112", "112"),
    ],
)
def test_a_suffix_that_may_change_the_elements_is_refused_by_name(text, suffix):
    message = f"bearing '{text}' is not known: the suffix {suffix} may stand for"
    with pytest.raises(ValueError, match=message):
        bearing_orders(text)


@pytest.mark.parametrize("text", ["62052", "16205", "620", "", "  ", "NU", "C3"])
def test_a_part_of_a_name_is_no_name(text):
    with pytest.raises(ValueError, match=f"bearing '{text}' is not known"):
        bearing_orders(text)


def test_bearings_of_the_same_size_are_named():
    message = r"'6209-2RS' is not known \(of the same size: 209K\)"
    with pytest.raises(ValueError, match=message):
        bearing_orders("6209-2RS")
