"""Tables and claims of the paper as printed."""

import json
from itertools import product
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
PAPER = json.loads((ROOT / "benchmarks/paper/printed_tables.json").read_text("utf-8"))
TABLES = {table["id"]: table for table in PAPER["tables"]}
CLAIMS = PAPER["claims"]
SPEEDS = (300, 400, 450, 500)
BY_SPEED = dict(zip(SPEEDS, ("table2", "table3", "table4", "table5"), strict=True))
BY_CRACK = {3: "table8", 6: "table9"}
#: Half of the last printed digit, and rounding of binary fractions.
HALF = 0.05 + 1e-9

WRONG_AVERAGES = {
    ("table2", "proposed", 3): (96.1, 96.375),
    ("table2", "ALPIO", 3): (77.6, 76.875),
    ("table2", "ALPIO", 6): (79.4, 79.125),
    ("table3", "proposed", 6): (98.2, 98.125),
    ("table4", "proposed", 6): (98.8, 98.25),
    ("table4", "ALPIO", 3): (79.6, 80.875),
    ("table4", "ALPIO", 6): (82.4, 82.625),
    ("table5", "proposed", 3): (99.9, 97.75),
    ("table5", "proposed", 6): (99.1, 98.375),
    ("table5", "ALPIO", 3): (81.2, 82.875),
    ("table5", "ALPIO", 6): (84.6, 84.25),
}


def column(rpm, method, crack_mm, source="by speed"):
    """Rows and printed average of one condition of test, from Tables 2-5 or from 8-9."""
    table = TABLES[BY_SPEED[rpm] if source == "by speed" else BY_CRACK[crack_mm]]
    head = {"method": method} | (
        {"crack_mm": crack_mm} if source == "by speed" else {"rpm": rpm}
    )
    number = table["columns"].index(head)
    values = np.array([row[number] for row in table["values"]])
    return values, table["printed_average"][number], table["rows"]


def differing_cells():
    """Every cell that Tables 2-5 and Tables 8-9 give different figures for."""
    cells = []
    for rpm, crack, method in product(SPEEDS, (3, 6), ("proposed", "ALPIO")):
        first, _, rows = column(rpm, method, crack)
        second, _, names = column(rpm, method, crack, "by crack")
        assert rows == names
        cells += [
            {"rpm": rpm, "crack_mm": crack, "method": method, "condition": row}
            | {"tables_2_5": int(a), "tables_8_9": int(b)}
            for row, a, b in zip(rows, first, second, strict=True)
            if a != b
        ]
    return cells
