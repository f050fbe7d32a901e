"""Blocks that are printed in full: a terminal example, bearings and file formats."""

import contextlib
import csv
import io
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

import pandas as pd

import skarxlag
from benchmarks.blocks import markdown
from skarxlag import bearing_orders
from skarxlag.plant.commands import main
from skarxlag.plant.readers.formats import FORMATS

_TRAIN_RPM, _RPM, _RATE = 800, 1400, "20000"
_CONDITIONS = {"N": "healthy", "I": "inner race", "O": "outer race", "B": "ball"}
#: Names of the diagnosed files, as a plant may call them.
_DIAGNOSED = {"N": "pump_7.mat", "O": "pump_8.mat"}
CATALOGUE = Path(skarxlag.__file__).parent / "bearings" / "catalogue.csv"
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
    "audio": ("WAV, FLAC, W64, RF64, AIFF, CAF, AU", "yes", "the rate"),
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


@cache
def terminal_example(home=None):
    """Return what ``diagnose`` prints of two recordings of UESTC, trained at 800 rpm.

    None if the recordings are not in the folder of the rigs.
    """
    folder = Path(home or os.environ.get("SKARXLAG_DATA", ".")) / "uestc"
    files = {path.stem.removesuffix("_1"): path for path in folder.rglob("*.mat")}
    if not files:
        return None
    lines = ["path,condition,rpm,sampling_rate"]
    for letter, condition in _CONDITIONS.items():
        path = files[f"{letter}_{_TRAIN_RPM}"].resolve()
        lines.append(f"{path},{condition},{_TRAIN_RPM},{_RATE}")
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
        Path("rec").mkdir()
        for letter, name in _DIAGNOSED.items():
            shutil.copy(files[f"{letter}_{_RPM}"], Path("rec", name))
        Path("table.csv").write_text("\n".join(lines), encoding="utf-8")
        _printed("fit table.csv --healthy healthy -o bearing.skops -q")
        names = " ".join(f"rec/{name}" for name in _DIAGNOSED.values())
        options = f"--sampling-rate {_RATE} --rpm {_RPM} -q"
        text = _printed(f"diagnose bearing.skops {names} {options}")
    command = f"$ skarxlag diagnose bearing.skops rec/*.mat --rpm {_RPM}"
    return "\n".join(f"    {line}".rstrip() for line in [command, *text.splitlines()])


def _printed(command):
    """Run a command, and return its output."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        status = main(command.split())
    assert status == 0
    return output.getvalue()


def formats(home=None):
    """Return the table of file formats, from the list of readers."""
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


def bearings(home=None):
    """Return the table of the catalogue of bearings."""
    with CATALOGUE.open(encoding="utf-8", newline="") as file:
        catalogue = list(csv.DictReader(file))
    rows = []
    for bearing in catalogue:
        orders = bearing_orders(bearing["name"])
        facts = {"name": bearing["name"], "elements": bearing["elements"]}
        places = ("outer", "inner", "spin", "cage")
        rows.append(facts | {place: orders[place] for place in places})
    return markdown(pd.DataFrame(rows))
