"""Generated blocks of Markdown pages, between marks of a name, and tables in them."""

import argparse
import re
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[1]
_BLOCK = re.compile(r"<!-- (.+?): begin -->\n(.*?)\n<!-- \1: end -->", re.DOTALL)


def markdown(frame, digits=3):
    """Return a Markdown table of a data frame without its index; floats rounded, NaN empty.

    Examples
    --------
    >>> print(markdown(pd.DataFrame({"rig": ["a"], "mean": [0.12345], "n": [3]})))
    | rig | mean | n |
    | --- | ---: | ---: |
    | a | 0.123 | 3 |
    """

    def cell(value):
        if isinstance(value, float):
            return "" if pd.isna(value) else f"{round(value, digits) + 0.0:.{digits}f}"
        return str(value)

    heads = [str(name) for name in frame.columns]
    numeric = [pd.api.types.is_numeric_dtype(dtype) for dtype in frame.dtypes]
    lines = [heads, ["---:" if is_number else "---" for is_number in numeric]]
    lines += [[cell(value) for value in row] for row in frame.itertuples(index=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def blocks_of(text):
    r"""Return the generated blocks of a page by name.

    Examples
    --------
    >>> blocks_of("a\n<!-- x: begin -->\nold\n<!-- x: end -->\nb")
    {'x': 'old'}
    """
    return {match[1]: match[2] for match in _BLOCK.finditer(text)}


def without_blocks(text):
    """Return the text of a page that people write."""
    return _BLOCK.sub("", text)


def put_block(text, name, block):
    r"""Put a block between the two marks of its name in a Markdown text.

    Raises
    ------
    ValueError
        If the text does not contain each mark once, in order.

    Examples
    --------
    >>> print(put_block("a\n<!-- x: begin -->\nold\n<!-- x: end -->\nb", "x", "new"))
    a
    <!-- x: begin -->
    new
    <!-- x: end -->
    b
    """
    if blocks_of(text).keys() >= {name} and text.count(f"<!-- {name}: ") == 2:
        marked = f"<!-- {name}: begin -->\n{block}\n<!-- {name}: end -->"
        return _BLOCK.sub(lambda m: marked if m[1] == name else m[0], text)
    raise ValueError(
        f"expected '<!-- {name}: begin -->' and '<!-- {name}: end -->' once in the page."
    )


def write_block(page, name, block):
    """Write a block into a page of the repository."""
    path = ROOT / page
    path.write_text(put_block(path.read_text("utf-8"), name, block), encoding="utf-8")


def page_parser(doc, name):
    """Return the parser of a command that writes CSV files and the blocks of a page."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    folder = Path("skarxlag-results") / name
    parser.add_argument("--output", type=Path, default=folder, help="for CSV files")
    text = "page to put the tables into"
    parser.add_argument("--write", type=Path, metavar="FILE", help=text)
    return parser


def publish(options, blocks):
    """Print the named blocks, and put them into the page that the options name."""
    for name, block in blocks.items() if options.write else ():
        write_block(options.write, name, block)
    print("\n\n".join(blocks.values()))
