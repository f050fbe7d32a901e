"""Picture of the report of ``diagnose``, as a telephone shows it on a light and on a dark screen.

``python -m benchmarks.figures.report_image`` writes docs/images/report.png. It needs
Chromium or Chrome, and the recordings of the UESTC rig: the diagnoser is fitted at 1000
rpm, and the report is of the recordings at 1400 rpm, of one without a signal, and of
one that is missing.
"""

import argparse
import os
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.figures.browser import picture
from benchmarks.recordings import fetch_uestc
from skarxlag.plant.commands import main as run

TRAIN_RPM, RPM = 1000, 1400
#: Number of the recording that is drawn.
DRAWN = 2
#: Its width in pixels.
TELEPHONE = 390


def run_command(*arguments):
    """Run a command of the package, without telling its progress."""
    run([*map(str, arguments), "-q"])


def report(folder, data_home):
    """Write the report of some recordings into a folder.

    Parameters
    ----------
    folder : Path
        An empty one.
    data_home : str or None
        Folder of the downloaded rigs.

    Returns
    -------
    str
        The page, on which one recording is drawn.
    """
    rig = fetch_uestc(data_home=data_home)
    head = "path,condition,rpm,sampling_rate"
    lines = {TRAIN_RPM: [head], RPM: [head]}
    for path in map(Path, rig.filenames):
        name = path.stem.removesuffix("_1")
        rpm = int(name.split("_")[1])
        if rpm in lines:
            shutil.copy(path, folder / f"{name}.mat")
            lines[rpm].append(
                f"{name}.mat,{name.split('_')[0]},{rpm},{rig.sampling_rate}"
            )
    np.save(folder / "dead.npy", np.zeros(200_000))
    lines[RPM] += [
        f"{name},N,{RPM},{rig.sampling_rate}" for name in ("dead.npy", "missing.npy")
    ]
    for rpm, recordings in lines.items():
        (folder / f"{rpm}.csv").write_text("\n".join(recordings))
    table, model, page = (
        folder / f"{RPM}.csv",
        folder / "uestc.skops",
        folder / "report.html",
    )
    run_command("fit", folder / f"{TRAIN_RPM}.csv", "--healthy", "N", "-o", model)
    run_command("diagnose", model, "--table", table, "-o", page)
    text = page.read_text("utf-8").replace(f"{folder}{os.sep}", "")
    before, *sections = re.split(r"(?=<section)", text)
    return f"{before}{sections[DRAWN]}</body></html>"


def main(argv=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/images/report.png"))
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    args = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        page = report(Path(folder), args.data_home)
    picture(page, args.figure, TELEPHONE)


if __name__ == "__main__":
    main()
