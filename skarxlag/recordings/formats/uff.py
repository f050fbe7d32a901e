"""Universal files: time responses in data sets 58 and 58b."""

import warnings
from pathlib import Path

from ._contents import Contents, common_length, slices
from ._facts import is_rate, rounded

TITLE = "Universal file (UFF 58)"
SUFFIXES = (".uff", ".unv")
LIBRARY, EXTRA = "pyuff", "formats"
ISOLATED = True
IN_PARTS = False
STATES = "rate and unit"

_TIME_RESPONSE = (0, 1)
_DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}


def contents(path: Path) -> Contents:
    """Return the channels by the first line of each data set, or as ``node:direction``.

    The latter names are used if first lines repeat.
    """
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 200, 0))
        if not file.read().rstrip().endswith(b"-1"):
            raise ValueError("the last data set has no end")
    heads = _time_responses(path)
    rates = {}
    for name, (_, head) in heads.items():
        step = head["abscissa_inc"]
        if head["abscissa_spacing"] == 1 and is_rate(step):
            # The file has six digits of the step.
            rates[name] = rounded(1 / step, 5e-6)
    units = {
        name: unit
        for name, (_, head) in heads.items()
        if (unit := head["ordinate_axis_units_lab"].strip()) not in ("", "NONE")
    }

    def read(names, n_samples):
        sets = _read(path, [heads[name][0] for name in names])
        for name, own in zip(names, sets, strict=True):
            if len(own["data"]) != lengths[name]:
                raise ValueError(f"{len(own['data'])} samples of {lengths[name]} in {name!r}")
        for part in slices(common_length(lengths, names), n_samples):
            yield [own["data"][part] for own in sets]

    lengths = {name: head["num_pts"] for name, (_, head) in heads.items()}
    return Contents(list(heads), read, rates, units, lengths)


def _time_responses(path):
    found = [
        (number, head)
        for number, head in enumerate(_read(path, None))
        if head.get("type") == 58 and head["func_type"] in _TIME_RESPONSE
    ]
    labels = [head["id1"].strip() for _, head in found]
    if len(set(labels)) < len(labels) or not all(labels):
        labels = [_place(head) for _, head in found]
    if len(set(labels)) < len(labels):
        labels = [str(i) for i in range(len(found))]
    return dict(zip(labels, found, strict=True))


def _place(head):
    direction = head["rsp_dir"]
    axis = _DIRECTIONS.get(abs(direction), str(direction))
    return f"{head['rsp_node']}:{axis.replace('+', '-') if direction < 0 else axis}"


def _read(path, numbers):
    from pyuff import UFF

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sets = UFF(str(path)).read_sets(numbers, header_only=numbers is None)
    return sets if isinstance(sets, list) else [sets]
