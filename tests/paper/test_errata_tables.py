"""Numbers of the paper, recomputed from the rows of its own tables."""

from itertools import product

import numpy as np
import pytest

from .printed import (
    BY_SPEED,
    CLAIMS,
    HALF,
    SPEEDS,
    TABLES,
    WRONG_AVERAGES,
    column,
    differing_cells,
)


def mean_over(method, cracks=(3, 6), speeds=SPEEDS, source="by speed", printed=False):
    columns = [
        column(rpm, method, crack, source) for rpm, crack in product(speeds, cracks)
    ]
    return np.mean(
        [average if printed else values.mean() for values, average, _ in columns]
    )


def improvement(crack, **options):
    return mean_over("proposed", (crack,), **options) - mean_over(
        "ALPIO", (crack,), **options
    )


@pytest.mark.parametrize("method", ["proposed", "ALPIO"])
@pytest.mark.parametrize("crack", [3, 6])
@pytest.mark.parametrize("rpm", SPEEDS)
def test_average_of_tables_2_to_5(rpm, crack, method):
    values, printed, _ = column(rpm, method, crack)
    wrong = WRONG_AVERAGES.get((BY_SPEED[rpm], method, crack))
    if wrong is None:
        assert abs(printed - values.mean()) <= HALF
    else:
        assert (printed, values.mean()) == wrong
        assert abs(printed - values.mean()) > HALF


def test_a_replaced_average_gives_the_improvement_of_the_abstract():
    printed = [column(rpm, "proposed", 3)[1] for rpm in SPEEDS]
    assert printed[-1] == 99.9
    alpio = mean_over("ALPIO", (3,), printed=True)
    assert np.mean([*printed[:-1], 97.8]) - alpio == pytest.approx(17.825)
    claimed = CLAIMS["abstract_improvement_3mm"]
    fitting = [
        tenths / 10
        for tenths in range(1001)
        if abs(np.mean([*printed[:-1], tenths / 10]) - alpio - claimed) < 0.0051
    ]
    assert fitting == [97.8]


@pytest.mark.parametrize(
    ("crack", "claims", "printed", "by_speed", "by_crack"),
    [
        (3, (17.82, 17.82, 17.62), 18.35, 17.3125, 17.46875),
        (6, (16.625, 16.625, 16.626), 16.625, 16.375, 16.75),
    ],
)
def test_improvement(crack, claims, printed, by_speed, by_crack):
    places = ("abstract", "section5", "conclusion")
    stated = [CLAIMS[f"{place}_improvement_{crack}mm"] for place in places]
    assert tuple(stated) == claims
    assert improvement(crack, printed=True) == pytest.approx(printed)
    assert improvement(crack) == pytest.approx(by_speed)
    assert improvement(crack, source="by crack") == pytest.approx(by_crack)


def test_improvement_without_the_training_set():
    tested = SPEEDS[:3]
    assert improvement(3, speeds=tested) == pytest.approx(18.125)
    assert improvement(6, speeds=tested) == pytest.approx(17.125)
    assert CLAIMS["training_dataset"] == 4 == TABLES["table5"]["dataset"]


@pytest.mark.parametrize(
    ("method", "claim", "by_speed", "printed", "by_crack"),
    [
        ("proposed", 98.8, 97.59375, 98.0125, 97.609375),
        ("ALPIO", 80.5, 80.75, 80.525, 80.5),
    ],
)
def test_overall_average(method, claim, by_speed, printed, by_crack):
    assert CLAIMS[f"average_identification_{method}_tables2_5"] == claim
    assert mean_over(method) == pytest.approx(by_speed)
    assert mean_over(method, printed=True) == pytest.approx(printed)
    assert mean_over(method, source="by crack") == pytest.approx(by_crack)


def test_eighteen_cells_have_two_values():
    cells = differing_cells()
    assert len(cells) == 18
    assert sum(cell["method"] == "ALPIO" for cell in cells) == 17
    assert max(abs(cell["tables_2_5"] - cell["tables_8_9"]) for cell in cells) == 8
    assert sum(len(TABLES[name]["rows"]) * 4 for name in BY_SPEED.values()) == 128


@pytest.mark.parametrize("name", ["table6", "table7"])
def test_precision_and_recall_are_swapped(name):
    table = TABLES[name]
    windows = np.array(table["values"])
    right, below = table["printed_right_margin"], table["printed_bottom_margin"]
    assert (right["label"], below["label"]) == ("Precision", "Recall")
    # 100 windows of each condition: the rows are the true classes, whatever their label
    # says.
    assert table["printed_row_label"] == "Predict Class"
    assert set(windows.sum(axis=1)) == {CLAIMS["windows"]}
    assert set(windows.sum(axis=0)) != {CLAIMS["windows"]}
    right_windows = np.diag(windows)
    recall, precision = (
        right_windows / windows.sum(axis=1),
        right_windows / windows.sum(axis=0),
    )
    np.testing.assert_allclose(right["values"], 100 * recall)
    np.testing.assert_allclose(below["values"], 100 * precision, atol=0.1)
    # Table 3 gives the same figures as the share of each condition that is found.
    values, _, rows = column(400, "proposed", table["crack_mm"])
    by_name = dict(zip(rows, values, strict=True))
    assert [by_name[each] for each in table["classes"]] == list(right_windows)


def test_overall_accuracy_of_table_6_is_impossible():
    windows = np.array(TABLES["table6"]["values"])
    printed = TABLES["table6"]["printed_overall"]
    assert printed == 95.07
    assert np.trace(windows) == 774
    assert 100 * np.trace(windows) / windows.sum() == 96.75
    reachable = 100 * np.arange(801) / 800
    assert np.abs(reachable - printed).min() > 0.005  # no count of 800 rounds to it


def test_margins_of_table_6_are_cut_in_two_places_and_rounded_in_the_others():
    for name, cut in (("table6", ["Ball", "OR-Ball"]), ("table7", [])):
        table = TABLES[name]
        windows = np.array(table["values"])
        exact = 100 * np.diag(windows) / windows.sum(axis=0)
        printed = np.array(table["printed_bottom_margin"]["values"])
        rounded = np.abs(printed - exact) <= HALF
        assert [
            each for each, ok in zip(table["classes"], rounded, strict=True) if not ok
        ] == cut
        np.testing.assert_array_equal(
            printed[~rounded], np.floor(exact[~rounded] * 10) / 10
        )


def test_no_normal_window_is_missed_in_table_6():
    windows = np.array(TABLES["table6"]["values"])
    assert TABLES["table6"]["classes"][0] == "Normal"
    assert windows[0].tolist() == [100, 0, 0, 0, 0, 0, 0, 0]
    assert windows[1:, 0].sum() == 3 and windows[1:].sum() == 700
    assert np.array(TABLES["table7"]["values"])[1:, 0].sum() == 1
    assert 100 * 100 / windows[:, 0].sum() == pytest.approx(97.09, abs=0.005)


def test_window_geometry():
    rate, length = CLAIMS["sampling_rate_hz"], CLAIMS["samples_per_window"]
    assert CLAIMS["windows"] * length == CLAIMS["samples_per_condition"] == 120_000
    assert length / rate == pytest.approx(4.8e-3)
    revolutions = {rpm: rpm / 60 * length / rate for rpm in SPEEDS}
    assert (revolutions[300], revolutions[500]) == pytest.approx((0.024, 0.040))
    assert [100 * revolutions[rpm] for rpm in (300, 500)] == pytest.approx([2.4, 4.0])
    assert (
        6 * max(revolutions.values()) < 0.25
    )  # impacts in a window, at six a revolution
