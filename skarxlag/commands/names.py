"""Names and numbers of recordings, as people read them."""

import re
from collections.abc import Iterable
from itertools import takewhile


def below_common_folder(names: Iterable[str]) -> tuple[str, list[str]]:
    """Leave out the longest folder that all names begin with.

    Parameters
    ----------
    names : iterable of str
        Paths, or what else recordings are called.

    Returns
    -------
    str, list of str
        The folder with the separator at its end, and the names below it. The folder is empty, and
        the names are as they were, where there is only one name or no common folder with a name.

    Examples
    --------
    >>> below_common_folder(["/data/rig/day 1/a.npy", "/data/rig/day 2/b.npy"])
    ('/data/rig/', ['day 1/a.npy', 'day 2/b.npy'])
    >>> below_common_folder(["/a.npy", "/b.npy"])
    ('', ['/a.npy', '/b.npy'])
    """
    names = list(names)
    if len(names) < 2:
        return "", names
    # Names that come from a table have slashes on every system.
    folders = [re.split(r"(?<=[/\\])", name)[:-1] for name in names]
    common = takewhile(lambda level: len(set(level)) == 1, zip(*folders, strict=False))
    folder = "".join(level[0] for level in common)
    if not folder.strip("./\\"):
        return "", names
    return folder, [name.removeprefix(folder) for name in names]


def counted(number: int, things: str) -> str:
    """A number and what is counted.

    Parameters
    ----------
    number : int
        How many.
    things : str
        What, in the plural.

    Returns
    -------
    str
        In the singular for one.

    Examples
    --------
    >>> counted(1, "recordings"), counted(1, "stretches"), counted(2, "windows")
    ('1 recording', '1 stretch', '2 windows')
    """
    if number == 1:
        things = things.removesuffix("es") if things.endswith("ches") else things.removesuffix("s")
    return f"{number} {things}"
