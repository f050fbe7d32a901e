"""Csv tables as texts, without the import of pandas."""

import csv
import os


def read_rows(path: str | os.PathLike[str]) -> dict[int, list[str]]:
    r"""Read the cells of a csv table. The sign that its first line holds most of separates.

    Parameters
    ----------
    path : str or path-like
        Text in UTF-8, separated by commas, semicolons or tabulators.

    Returns
    -------
    dict of int to list of str
        Cells without blanks around them, by the number of the line. All rows have as
        many cells as the first; those that are missing are empty. Rows without any text
        are left out, except the first.

    Raises
    ------
    ValueError
        If the file is empty or no such table, or a row has more cells than the first.
        The message names the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "table.csv")
    ...     _ = path.write_text("path;rpm\n;\nrun.wav; 900\nb.wav\n")
    ...     read_rows(path)
    {1: ['path', 'rpm'], 3: ['run.wav', '900'], 4: ['b.wav', '']}
    """
    try:
        with open(path, encoding="utf-8-sig") as file:
            separator = max(",;\t", key=file.readline().count)
            file.seek(0)
            return _cells(csv.reader(file, delimiter=separator, strict=True))
    except (ValueError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read as a csv table ({error})") from error


def _cells(reader):
    rows = {}
    n_cells = 0
    line = 1
    for row in reader:
        cells = [cell.strip() for cell in row]
        if line == 1:
            n_cells = len(cells)
        if len(cells) > n_cells:
            raise ValueError(f"line {line} has {len(cells)} cells, expected {n_cells}")
        if any(cells) or line == 1:
            rows[line] = cells + [""] * (n_cells - len(cells))
        # A cell in quotes may hold several lines.
        line = reader.line_num + 1
    if n_cells == 0:
        raise ValueError("the first line is empty")
    return rows
