"""Write the table of file formats, from the list of readers.

``python -m benchmarks.pages.formats --write docs/recordings.md``
"""

import argparse
from pathlib import Path

import pandas as pd

from benchmarks.pages.blocks import markdown, publish
from skarxlag.plant.readers.formats import FORMATS

#: Name of each format, whether it is read in parts, and the facts that are read besides
#: samples.
DESCRIPTIONS = {
    "matlab": (
        "MATLAB up to version 7",
        "no",
        "the rate, in a number named `fs` or alike",
    ),
    "npy": ("NumPy array", "yes", "nothing"),
    "npz": ("NumPy archive", "no", "the rate, in a number named `fs` or alike"),
    "text": (
        "text, also packed by gzip",
        "yes",
        "the rate, by a time column; units, in a second line or in brackets",
    ),
    "wav": ("WAV", "yes", "the rate"),
    "audio": ("FLAC, W64, RF64, AIFF, CAF, AU", "yes", "the rate"),
    "arrow": ("Parquet, Feather", "yes", "the rate, by a time column"),
    "hdf5": (
        "HDF5, MATLAB 7.3",
        "yes",
        "rate and unit, in attributes named `fs`, `units` or alike, or in single numbers",
    ),
    "tdms": (
        "NI TDMS",
        "yes",
        "rate (`wf_increment`, or a number named `fs` or alike), unit (`unit_string`) and date "
        "(`wf_start_time`)",
    ),
    "uff": ("Universal file (UFF 58)", "no", "rate and unit"),
    "vallen": ("Vallen tradb", "yes", "rate and unit (V)"),
    "raw": ("raw binary, with a stated `dtype`", "yes", "nothing"),
}


def formats_table():
    """Return a Markdown table of all formats."""
    rows = []
    for module in FORMATS:
        each = module.FORMAT
        title, in_parts, states = DESCRIPTIONS[module.__name__.rpartition(".")[2]]
        rows.append(
            {
                "format": title,
                "file names": " ".join(f"`{suffix}`" for suffix in each.suffixes),
                "library": each.library or "",
                "extra": f"`{each.extra}`" if each.library else "",
                "in parts": in_parts,
                "own process": "yes" if each.isolated else "no",
                "states": states,
            }
        )
    return markdown(pd.DataFrame(rows))


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file with its marks"
    )
    publish(parser.parse_args(arguments), {"file formats": formats_table()})


if __name__ == "__main__":
    main()
