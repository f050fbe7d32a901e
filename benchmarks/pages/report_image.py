"""Picture of the report of ``diagnose``, as a telephone shows it on a light and on a dark screen.

``python -m benchmarks.pages.report_image`` writes docs/images/report.png. It needs Chromium or
Chrome, and the recordings of the UESTC rig: the diagnoser is fitted at 1000 rpm, and the report is
of the recordings at 1400 rpm, of one without a signal, and of one that is missing.
"""

import argparse
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from skarxlag.commands import main as run
from skarxlag.datasets import fetch_uestc

TRAIN_RPM, RPM = 1000, 1400
#: Place of the recording that is drawn.
DRAWN = 2
WIDTH, TALLEST, GAP, N_COLOURS = 390, 3000, 20, 96
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")


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
            lines[rpm].append(f"{name}.mat,{name.split('_')[0]},{rpm},{rig.sampling_rate}")
    np.save(folder / "dead.npy", np.zeros(200_000))
    lines[RPM] += [f"{name},N,{RPM},{rig.sampling_rate}" for name in ("dead.npy", "missing.npy")]
    for rpm, own in lines.items():
        (folder / f"{rpm}.csv").write_text("\n".join(own))
    table, model, page = folder / f"{RPM}.csv", folder / "uestc.skops", folder / "report.html"
    run_command("fit", folder / f"{TRAIN_RPM}.csv", "--healthy", "N", "-o", model)
    run_command("diagnose", model, "--table", table, "-o", page)
    text = page.read_text("utf-8").replace(f"{folder}{os.sep}", "")
    before, *sections = re.split(r"(?=<section)", text)
    return f"{before}{sections[DRAWN]}</body></html>"


def screenshot(page, path, is_dark):
    """Write a picture of a page on a telephone.

    Parameters
    ----------
    page, path : Path
        What is shown, and the file to write.
    is_dark : bool
        Whether the telephone prefers dark pages.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit(f"no browser found, expected one of {', '.join(BROWSERS)}")
    options = [
        "--headless",
        "--hide-scrollbars",
        f"--window-size={WIDTH},{TALLEST}",
        f"--blink-settings=preferredColorScheme={0 if is_dark else 1}",
        f"--user-data-dir={page.parent / 'browser'}",
        f"--screenshot={path}",
    ]
    # Its sandbox refuses to run as root.
    options += ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    subprocess.run([browser, *options, page.as_uri()], check=True, capture_output=True, timeout=120)


def side_by_side(paths):
    """Pictures of one page beside each other, without what is empty below them.

    Parameters
    ----------
    paths : list of Path
        Pictures of the same size.

    Returns
    -------
    Image
        With a transparent gap between them.
    """
    pictures = [Image.open(path).convert("RGBA") for path in paths]
    rows = np.asarray(pictures[0])
    bottom = np.flatnonzero((rows != rows[-1, -1]).any(axis=(1, 2)))[-1] + GAP // 2
    whole = Image.new("RGBA", (len(pictures) * (WIDTH + GAP) - GAP, int(bottom)))
    for place, picture in enumerate(pictures):
        whole.paste(picture.crop((0, 0, WIDTH, bottom)), (place * (WIDTH + GAP), 0))
    return whole.quantize(N_COLOURS)


def main(argv=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/images/report.png"))
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    args = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        page, paths = Path(folder, "page.html"), [Path(folder, f"{i}.png") for i in range(2)]
        page.write_text(report(Path(folder), args.data_home), "utf-8")
        for is_dark, path in enumerate(paths):
            screenshot(page, path, bool(is_dark))
        side_by_side(paths).save(args.figure, optimize=True)


if __name__ == "__main__":
    main()
