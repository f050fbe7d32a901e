"""Tables of docs/tables in the form of dot plots: a dot in a row of the data frame.

The columns are panel, row, series, value, low and high. The last two hold an interval,
and are empty without one. The series `RIG` holds the values of single rigs.
"""

import re
from operator import itemgetter

import pandas as pd

from benchmarks.pages.modules import ROOT

RIGS = (
    "UESTC",
    "SpectraQuest",
    "self-built",
    "CWRU drive end",
    "CWRU fan end",
    "MFPT",
    "motor sound",
)
#: Series of the values of single rigs, and of their mean.
RIG, MEAN = "rig", "mean of the real rigs"


def read_table(name):
    """Return the dots of a table.

    Parameters
    ----------
    name : str
        Key of `TABLES`: the name of its csv file.

    Returns
    -------
    DataFrame
        With the columns of this module's description.
    """
    path = ROOT / "docs" / "tables" / f"{name}.csv"
    stored = pd.read_csv(path, dtype=str, keep_default_na=False)
    columns = ("panel", "row", "series", "value", "low", "high")
    dots = pd.DataFrame(TABLES[name](stored), columns=columns)
    return dots.astype({"value": float, "low": float, "high": float}).dropna(
        subset="value"
    )


def number(text, position=0):
    """Return the number at a position of a cell, NaN if it has fewer.

    Examples
    --------
    >>> number("0.852 (0.65 to 0.99)", 1), number("**0.894**"), number("")
    (0.65, 0.894, nan)
    """
    numbers = re.findall(r"-?\d+(?:,\d{3})*(?:\.\d+)?", text)
    if position >= len(numbers):
        return float("nan")
    return float(numbers[position].replace(",", ""))


def dot(panel, row, series, cell, interval=""):
    """Return a dot: the first number of a cell, with the two numbers of an interval."""
    return (
        panel,
        row,
        series,
        number(cell),
        number(interval, 0),
        number(interval, 1),
    )


def means_and_rigs(panel, row, interval=None):
    """Return a function that makes dots of a table of methods: their mean, and each rig.

    Parameters
    ----------
    panel : callable or None
        From a row of the table to the title of its panel.
    row : str
        Column of the labels.
    interval : str, optional
        Column of the intervals of the mean.
    """

    def dots(table):
        made = []
        for cells in table.to_dict("records"):
            title = panel(cells)
            rigs = [cells[rig] for rig in RIGS if rig in cells]
            made += [dot(title, cells[row], RIG, cell) for cell in rigs]
            limits = cells.get(interval, "")
            made.append(dot(title, cells[row], MEAN, cells["mean of rigs"], limits))
        return made

    return dots


def series_of_columns(panel, row, columns):
    """Return a function that makes one series of each column; `columns` maps it to its name."""

    def dots(table):
        return [
            dot(panel(cells), row(cells), name, cells[column])
            for cells in table.to_dict("records")
            for column, name in columns.items()
            if cells[column]
        ]

    return dots


def _title(cells):
    return cells["table"]


def _protocol(cells):
    return cells["protocol"]


def _rig(cells):
    return cells["rig"]


def _untitled(_cells):
    return ""


def _curve(table):
    return [
        dot(
            cells["protocol"],
            cells["rig"],
            cells["training"],
            cells["right"],
            cells["right"].partition("(")[2],
        )
        for cells in table.to_dict("records")
    ]


def _targets(table):
    """Return accuracies; the second table of the file, of calibration, has no methods."""
    accuracies = table[table["method"] != ""]
    return means_and_rigs(
        lambda cells: f"{cells['rows']}, trained at {cells['trained at']}", "method"
    )(accuracies)


def _another_bearing(table):
    return [
        dot(
            "",
            cells["rig"],
            cells["method"].replace("`", "").removesuffix(" (ours)"),
            cells["right"],
            cells["right"].partition("(")[2],
        )
        for cells in table.to_dict("records")
    ]


def _noise(table):
    made = []
    for cells in table.to_dict("records"):
        for kind in sorted(cells.keys() - {"table", "rig"}):
            named, _, rows = cells[kind].partition(" of ")
            made.append(dot("", cells["rig"], kind, f"{100 * int(named) / int(rows)}"))
    return made


def _runs_of_orders(table):
    """Return how long before the end a fault is named for good."""
    return [
        dot(
            "",
            f"{cells['run']}, channel {cells['channel']}",
            cells["name that stays"],
            cells["before the end, s"],
        )
        for cells in table.to_dict("records")
    ]


def _soak(table):
    return [
        dot("", f"{int(cells['windows']):,} windows", "MiB", cells["MiB"])
        for cells in table.to_dict("records")
    ]


def _few_snapshots(table):
    return [
        dot(
            "",
            f"{cells['healthy snapshots']} snapshots",
            name,
            cells[f"{name}, share of the run"],
        )
        for cells in table.to_dict("records")
        for name in ("earliest", "latest")
    ]


def _ablation(table):
    parts = table[table["part"] != "all parts"]
    return means_and_rigs(_title, "part", "90 % interval")(parts)


def _detection(table):
    """Return false alarms and missed faults at a stated rate of 1 %, other speeds given."""
    made = []
    for cells in table.to_dict("records"):
        alarms, missed, _ = cells["left out"].split(", ")
        label = f"{cells['rig']}, {cells['row']}"
        detector = cells["detector"]
        made.append(dot("false alarms (stated: 1 %)", label, detector, alarms))
        made.append(dot("missed faults", label, detector, missed))
    return made


def _named(table):
    made = []
    for cells in table.to_dict("records"):
        label = f"{cells['rig']}, {cells['location']}"
        for outcome in ("right", "wrong", "abstained"):
            # A dot at zero would only hide the others.
            if count := int(cells[outcome]):
                share = 100 * count / int(cells["recordings"])
                made.append(dot("", label, outcome, f"{share}"))
    return made


def _variants(table):
    """Return the accuracy of each variant on each real rig, and the mean of these."""
    made = []
    for cells in table[table["table"] == "Accuracy"].to_dict("records"):
        rigs = [cells[f"{rig}: mean"] for rig in RIGS if cells.get(f"{rig}: mean")]
        made += [dot("", cells["variant"], RIG, cell) for cell in rigs]
        mean = sum(map(number, rigs)) / len(rigs)
        made.append(dot("", cells["variant"], MEAN, f"{mean}"))
    return made


def _families(table):
    """Return missed faults of each condition, with healthy rows of the other speeds."""
    made = []
    for cells in table[table["split"] == "left out"].to_dict("records"):
        for family in cells["missed"].split(", "):
            condition, _, missed = family.rpartition(" ")
            label = f"{cells['rig']}, {cells['row']}, {condition}"
            made.append(dot("", label, cells["detector"], missed))
    return made


def _rejected(**columns):
    """Return a function that makes a panel of each column: shares at a stated rate of 5 %."""

    def dots(table):
        return [
            dot(
                panel.replace("_", " "),
                f"{cells['rig']}, {cells['row']}",
                cells["calibrated and tested"],
                cells[column].partition("/")[2],
            )
            for cells in table.to_dict("records")
            for panel, column in columns.items()
        ]

    return dots


def _quality(table):
    made = []
    for cells in table.to_dict("records"):
        if cells["rig"]:
            made.append(dot("good rows", cells["rig"], "all lengths", cells["all"]))
        elif cells["table"].startswith("Damaged"):
            made += [
                dot("damaged rows", cells["treatment"], length, cells[length])
                for length in ("0.05 s", "0.5 s", "2 s", "whole")
            ]
    return made


def _speed(table):
    made = []
    what = ""
    for cells in table.to_dict("records"):
        continued = cells["what"].startswith(("the same", "of which"))
        what = what if continued else cells["what"]
        peer = re.match(r"(MiniRocket|NumPy|numba)[^:]*", cells["next to"])
        if peer:
            label = re.sub(r", \d+ x \d+.*|: times.*", "", what).replace("`", "")
            made.append(dot("", f"{label} / {peer[0]}", "ours", cells["measured"]))
    return made


def _stretches(table):
    """Return shares of right conditions, and of right fault locations in parentheses."""
    made = []
    lengths = [name for name in table if name.endswith(" s")]
    for cells in table.to_dict("records"):
        for length in lengths:
            condition, _, location = cells[length].partition("(")
            label = cells["method"]
            panel = f"{cells['rig']}: condition"
            made.append(dot(panel, label, length, condition))
            panel = f"{cells['rig']}: fault location"
            made.append(dot(panel, label, length, location))
    return made


def _simulated_stretches(table):
    return [
        dot(cells["rig"], cells["method"], length, cells[length])
        for cells in table.to_dict("records")
        for length in ("1 s", "2 s")
    ]


TABLES = {
    "ablation": _variants,
    "detection_families": _families,
    "unknown": _rejected(
        known_conditions="known rejected, %", unknown_conditions="unknown rejected, %"
    ),
    "other_kinds": _rejected(white_noise="white noise, %", other_rig="other rig, %"),
    "fault_orders_stretches": _named,
    "stretches_training": _stretches,
    "cross-speed_overview": means_and_rigs(_title, "method", "90 % interval"),
    "targets": _targets,
    "ablation_overview": _ablation,
    "another_bearing": series_of_columns(
        _protocol,
        _rig,
        {
            "`make_diagnoser` with the bearing (ours)": "make_diagnoser with the bearing",
            "`make_diagnoser` (ours)": "make_diagnoser",
            "combs alone (ours)": "combs alone",
            "log spectrum + shrinkage LDA": "log spectrum + shrinkage LDA",
            "log spectrum + SVM": "log spectrum + SVM",
        },
    ),
    "another_bearing_curve": _curve,
    "another_bearing_overview": _another_bearing,
    "another_bearing_noise": _noise,
    "fault_orders_runs": _runs_of_orders,
    "soak": _soak,
    "recording_evidence": series_of_columns(
        panel=itemgetter("test"),
        row=itemgetter("rig"),
        columns={f"accuracy, {way}": way for way in ("sum", "mean residuals")},
    ),
    "few_healthy_snapshots": _few_snapshots,
    "bearings": series_of_columns(
        _untitled,
        lambda cells: cells["name"],
        {
            "outer": "outer race (BPFO)",
            "inner": "inner race (BPFI)",
            "spin": "spin of an element (BSF)",
            "cage": "cage (FTF)",
        },
    ),
    "detection": _detection,
    "fault_orders_joint": series_of_columns(
        _protocol,
        _rig,
        {
            "location, spectra": "spectra alone",
            "location, combs": "combs alone",
            "location, both": "both together",
        },
    ),
    "fault_orders_methods": means_and_rigs(_untitled, "method"),
    "fault_orders_named": _named,
    "fleet-scale": lambda table: [
        dot("", cells["what"], "sensors", cells["sensors at the limit"])
        for cells in table.to_dict("records")
        if cells["sensors at the limit"]
    ],
    "signal_quality": _quality,
    "speed": _speed,
    "stretches_overview": _stretches,
    "stretches_simulated": _simulated_stretches,
}
