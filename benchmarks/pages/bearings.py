"""Write the table of the catalogue of bearings, with the source of each.

``python -m benchmarks.pages.bearings --write docs/bearings.md``
"""

import argparse
import csv
from pathlib import Path

import pandas as pd

import skarxlag
from benchmarks.pages.blocks import markdown, publish
from skarxlag import bearing_orders

CATALOGUE = Path(skarxlag.__file__).parent / "bearings" / "catalogue.csv"


def bearings_table():
    """Return a Markdown table of all bearings."""
    with CATALOGUE.open(encoding="utf-8", newline="") as file:
        catalogue = list(csv.DictReader(file))
    rows = []
    for bearing in catalogue:
        orders = bearing_orders(bearing["name"])
        rows.append(
            {
                "name": bearing["name"],
                "type": bearing["type"],
                "elements": bearing["elements"],
                "outer": orders["outer"],
                "inner": orders["inner"],
                "spin": orders["spin"],
                "cage": orders["cage"],
                "source": _source(bearing),
            }
        )
    return markdown(pd.DataFrame(rows))


def _source(bearing):
    """Return the source, and where it was read."""
    source = bearing["source"]
    read_in = bearing["read_in"]
    if "Timken" in source:
        source = source.partition(", basic outer-ring size")[0]
    return source if read_in == "the source" else f"{source}. Read in {read_in}"


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file with its marks"
    )
    publish(parser.parse_args(arguments), {"bearings": bearings_table()})


if __name__ == "__main__":
    main()
