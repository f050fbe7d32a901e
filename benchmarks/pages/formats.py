"""Write the table of file formats, from the list of readers.

``python -m benchmarks.pages.formats --write docs/recordings.md``
"""

import argparse
from pathlib import Path

import pandas as pd

from benchmarks.pages.blocks import markdown, publish
from skarxlag.recordings.formats import FORMATS


def formats_table():
    """Markdown table of all formats."""
    rows = [
        {
            "format": module.TITLE,
            "file names": " ".join(f"`{suffix}`" for suffix in module.SUFFIXES),
            "library": module.LIBRARY or "",
            "extra": f"`{module.EXTRA}`" if module.EXTRA else "",
            "in parts": "yes" if module.IN_PARTS else "no",
            "own process": "yes" if module.ISOLATED else "no",
            "states": module.STATES,
        }
        for module in FORMATS
    ]
    return markdown(pd.DataFrame(rows))


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path, metavar="FILE", help="Markdown file with its marks")
    publish(parser.parse_args(arguments), {"file formats": formats_table()})


if __name__ == "__main__":
    main()
