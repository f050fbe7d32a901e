"""Pictures of web pages, on light and on dark screens; they need Chromium or Chrome."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

TALLEST = 3000
GAP = 20
N_COLOURS = 96
#: Values of the setting of the browser.
SCHEMES = {"light": 1, "dark": 0}
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")


def picture(page, path, width, schemes=tuple(SCHEMES)):
    """Draw a page on screens next to each other.

    Parameters
    ----------
    page : str
        The page, as HTML.
    path : Path
        The png file to write.
    width : int
        Of each screen, in pixels.
    schemes : sequence of {"light", "dark"}, default=("light", "dark")
        What each screen prefers.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "page.html")
        paths = [Path(folder, f"{name}.png") for name in schemes]
        source.write_text(page, "utf-8")
        for scheme, each in zip(schemes, paths, strict=True):
            _screenshot(source, each, width, scheme)
        _side_by_side(paths).save(path, optimize=True)


def _screenshot(page, path, width, scheme):
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit(f"no browser found, expected one of {', '.join(BROWSERS)}")
    options = [
        "--headless",
        "--hide-scrollbars",
        f"--window-size={width},{TALLEST}",
        f"--blink-settings=preferredColorScheme={SCHEMES[scheme]}",
        f"--user-data-dir={page.parent / 'browser'}",
        f"--screenshot={path}",
    ]
    # Its sandbox refuses to run as root.
    options += ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    subprocess.run(
        [browser, *options, page.as_uri()], check=True, capture_output=True, timeout=120
    )


def _side_by_side(paths):
    """Pictures of one size with a transparent gap, without what is empty below them."""
    pictures = [Image.open(path).convert("RGBA") for path in paths]
    rows = np.asarray(pictures[0])
    bottom = int(np.flatnonzero((rows != rows[-1, -1]).any(axis=(1, 2)))[-1]) + GAP // 2
    width = pictures[0].width
    whole = Image.new("RGBA", (len(pictures) * (width + GAP) - GAP, bottom))
    for number, each in enumerate(pictures):
        whole.paste(each.crop((0, 0, width, bottom)), (number * (width + GAP), 0))
    return whole.quantize(N_COLOURS)
