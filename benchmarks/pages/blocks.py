"""Markdown tables, and the marked blocks of a page that a command writes."""

import argparse
import os
import re
from pathlib import Path, PurePosixPath

import pandas as pd

from benchmarks.pages.modules import ROOT
from benchmarks.pages.parts import PARTS
from benchmarks.pages.states import record, recorded


def page_parser(doc, name):
    """Parser of a command that writes CSV files and the tables of a page.

    Parameters
    ----------
    doc : str
        Docstring of the command.
    name : str
        Folder of its results under ``skarxlag-results``.
    """
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("skarxlag-results") / name,
        help="folder of the CSV files",
    )
    parser.add_argument(
        "--write",
        type=Path,
        metavar="FILE",
        help="Markdown file to put the tables into",
    )
    return parser


def markdown(frame, digits=3):
    """Return a Markdown table of a data frame without its index; floats rounded, NaN left empty.

    Columns of numbers, and of numbers as text, are aligned on the right.

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

    def is_number(column):
        filled = column[~column.isin(["", "-"])]
        return len(filled) > 0 and pd.to_numeric(filled, errors="coerce").notna().all()

    numeric = [
        pd.api.types.is_numeric_dtype(dtype) or is_number(frame.iloc[:, number])
        for number, dtype in enumerate(frame.dtypes)
    ]
    lines = [
        list(map(str, frame.columns)),
        ["---:" if each else "---" for each in numeric],
    ]
    lines += [[cell(value) for value in row] for row in frame.itertuples(index=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def put_block(text, name, block):
    r"""Put `block` between the two marks of that name in a Markdown text.

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
    begin = f"<!-- {name}: begin -->"
    end = f"<!-- {name}: end -->"
    before, found_begin, rest = text.partition(begin)
    _, found_end, after = rest.partition(end)
    if (
        not (found_begin and found_end)
        or text.count(begin) != 1
        or text.count(end) != 1
    ):
        raise ValueError(
            f"expected one {begin!r} followed by one {end!r} in the Markdown file."
        )
    return f"{before}{begin}\n{block}\n{end}{after}"


def to_csv(block, path, link):
    """Store the tables of a block in one csv file; return the block with a link in their place.

    The first column of the file names the table, if there are several: by the text of
    its fold, or by the line before it.

    Parameters
    ----------
    block : str
        Markdown with one or more tables.
    path : Path
        The csv file to write.
    link : str
        Its address as seen from the page.
    """
    frames = []
    prose = []
    fold = ""
    caption = ""
    for paragraph in block.split("\n\n"):
        if summary := re.search(r"<summary>(.*)</summary>", paragraph):
            fold = summary[1]
        elif paragraph == "</details>":
            fold = ""
        elif paragraph.startswith("| "):
            head, _, *rows = [
                line[2:-2].split(" | ") for line in paragraph.splitlines()
            ]
            title = "; ".join(filter(None, [fold, caption]))
            frame = pd.DataFrame(rows, columns=[name or "row" for name in head])
            frames.append(frame.assign(table=title))
            caption = ""
        elif fold or paragraph.startswith("**") or paragraph.endswith(":"):
            caption = paragraph.replace("**", "").rstrip(":")
        else:
            prose.append(paragraph)
    frame = pd.concat(frames)
    first = ["table"] if frame["table"].any() else []
    path.parent.mkdir(parents=True, exist_ok=True)
    frame[first + [name for name in frame if name != "table"]].to_csv(path, index=False)
    return "\n\n".join([*prose, f"[Table as csv]({link})"])


def table_file(page, name):
    """Return the csv file of a block: in the folder of its page, or else in docs.

    Examples
    --------
    >>> table_file("docs/paper/tables.md", "gains").as_posix()
    'docs/paper/tables/gains.csv'
    >>> table_file("README.md", "cross-speed overview").as_posix()
    'docs/tables/cross-speed_overview.csv'
    """
    folder = PurePosixPath(page).parent
    if not folder.is_relative_to("docs"):
        folder = PurePosixPath("docs")
    return folder / "tables" / f"{name.replace(' ', '_')}.csv"


def write_blocks(path, blocks):
    """Write named blocks into a Markdown file, if it contains their marks.

    A line below each block states the command, the version of the package and the date.

    Raises
    ------
    ValueError
        If it contains no marks of these blocks.
    """
    text = path.read_text(encoding="utf-8")
    held = [name for name in blocks if f"<!-- {name}: " in text]
    if not held:
        raise ValueError(f"{path} contains no marks of any of {list(blocks)}.")
    page = path.resolve()
    page = page.relative_to(ROOT).as_posix() if page.is_relative_to(ROOT) else path.name
    outputs = {name: f"{page}: {name}" for name in held}
    record(outputs.values())
    for name, output in outputs.items():
        block = blocks[name]
        if any(
            output in part.outputs() and name in part.tables for part in PARTS.values()
        ):
            table = ROOT / table_file(page, name)
            link = os.path.relpath(table, path.resolve().parent)
            block = to_csv(block, table, link)
        if made := stamp(output):
            block = f"{block}\n\n{made}"
        text = put_block(text, name, block)
    path.write_text(text, encoding="utf-8")


def stamp(output):
    """Return the line that states how and when an output was made, empty if it is not listed."""
    names = [name for name, part in PARTS.items() if output in part.outputs()]
    state = recorded().get(output)
    if not (names and state):
        return ""
    maker = f"`python -m benchmarks.pages {names[0]}`"
    if output.startswith("README.md"):
        # Readers of the first page want no commands in captions.
        maker = "[a benchmark](benchmarks/README.md)"
    return f"*Made by {maker} with version {state['version']}, {state['date']} UTC.*"


def publish(options, blocks):
    """Print the named Markdown blocks; put them into the file that the options name."""
    if options.write:
        write_blocks(options.write, blocks)
    print("\n\n".join(blocks.values()))
