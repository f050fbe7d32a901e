"""Universal files: time responses in data sets 58 and 58b."""

import warnings
from pathlib import Path

from ._contents import Channel, Contents, Format, slices
from ._facts import is_rate, rounded

FORMAT = Format(
    "Universal file (UFF 58)",
    (".uff", ".unv"),
    library="pyuff",
    isolated=True,
    in_parts=False,
    states="rate and unit",
)

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
    heads, channels = _time_responses(path), {}
    for name, (_, head) in heads.items():
        step, unit = head["abscissa_inc"], head["ordinate_axis_units_lab"].strip()
        # The file has six digits of the step.
        is_even = head["abscissa_spacing"] == 1 and is_rate(step)
        rate = rounded(1 / step, 5e-6) if is_even else None
        channels[name] = Channel(head["num_pts"], rate, None if unit in ("", "NONE") else unit)

    def read(names, n_samples):
        sets = _read(path, [heads[name][0] for name in names])
        n_total = channels[names[0]].length
        for name, own in zip(names, sets, strict=True):
            if len(own["data"]) != n_total:
                raise ValueError(f"{len(own['data'])} samples of {n_total} in {name!r}")
        for part in slices(n_total, n_samples):
            yield [own["data"][part] for own in sets]

    return Contents(channels, read)


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
