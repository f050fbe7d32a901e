"""Write the table of file formats, from the list of readers.

``python -m benchmarks.pages.formats --write docs/recordings.md``
"""

import argparse
from pathlib import Path

import pandas as pd

from benchmarks.pages.blocks import markdown, publish
from skarxlag.recordings.formats import FORMATS


def formats_table():
    """Return a Markdown table of all formats."""
    rows = [
        {
            "format": each.title,
            "file names": " ".join(f"`{suffix}`" for suffix in each.suffixes),
            "library": each.library or "",
            "extra": f"`{each.extra}`" if each.library else "",
            "in parts": "yes" if each.in_parts else "no",
            "own process": "yes" if each.isolated else "no",
            "states": each.states,
        }
        for each in (module.FORMAT for module in FORMATS)
    ]
    return markdown(pd.DataFrame(rows))


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path, metavar="FILE", help="Markdown file with its marks")
    publish(parser.parse_args(arguments), {"file formats": formats_table()})


if __name__ == "__main__":
    main()
