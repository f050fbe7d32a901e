"""Universal files: time responses in data sets 58 and 58b. The chosen sets are read whole."""

import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from .arrays import NamedArrays
from .contents import ContentError, Contents, DamagedError, Format
from .facts import SECONDS, is_rate, rounded

FORMAT = Format((".uff", ".unv"), library="pyuff", isolated=True)

_TIME_RESPONSE = (0, 1)


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the first line of each data set, or by position if lines repeat."""
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 200, 0))
        if not file.read().rstrip().endswith(b"-1"):
            raise DamagedError("the last data set has no end")
    sets = [
        (number, head)
        for number, head in enumerate(_read(path, None))
        if head.get("type") == 58 and head["func_type"] in _TIME_RESPONSE
    ]
    if not sets:
        kinds = ", ".join(sorted(map(str, {*_file(path).get_set_types()})))
        raise ContentError(f"holds no time record (data set 58), only sets {kinds}")
    names = [head["id1"].strip() for _, head in sets]
    if not all(names) or len(set(names)) < len(names):
        names = [str(i) for i in range(len(sets))]
    arrays = NamedArrays(cache(lambda number: _read(path, [number])[0]["data"]))
    for name, (number, head) in zip(names, sets, strict=True):
        unit = head["ordinate_axis_units_lab"].strip()
        if head["abscissa_spacing"] == 0:
            arrays.refused[name] = (
                f"the abscissa of {name} is not evenly spaced, expected an even one"
            )
            continue
        scale = SECONDS.get(head["abscissa_axis_units_lab"].strip().lower(), 1.0)
        step = head["abscissa_inc"] * scale
        # The file has six digits of the step.
        rates = {"the abscissa": rounded(1 / step, 5e-6)} if is_rate(step) else {}
        arrays.add(
            name,
            (head["num_pts"],),
            key=number,
            unit=None if unit in ("", "NONE") else unit,
            rates=rates,
        )
    yield arrays.contents()


def _read(path, numbers):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sets = _file(path).read_sets(numbers, header_only=numbers is None)
    return sets if isinstance(sets, list) else [sets]


def _file(path):
    from pyuff import UFF

    return UFF(str(path))
