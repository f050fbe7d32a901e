"""Designations of bearings: a name in the catalogue, and suffixes after it."""

import re
from collections.abc import Mapping

_MAKERS = r"^(SKF|FAG|INA|NSK|NTN|SNR|KOYO|JTEKT|NACHI|TIMKEN|FAFNIR|SCHAEFFLER|ZKL|LDK|MB|REXNORD)"
#: Suffixes that change neither the number nor the size of the rolling elements, as
#: regular expressions.
_SUFFIXES = {
    "seals and shields": (
        r"2?RS(?:[RHLTC]?[12]?)(?:JEM)?|2?RZ|2?Z[ER]?|ZZ[CES]?|LL[UBHX]?|L[UBH]|DDU?|VV|2?NSE?"
    ),
    "internal clearance": r"C[1-5]|C[MN]|CN[HLM]",
    "tolerance class": r"P[0-6][A-Z]?|ABEC[1-9]",
    "snap ring": r"NR?",
    "tapered bore": r"K(?:30)?",
    "cage": r"JEM|J[RAE]?|M[ABR]?|TN[9H]?|TV[PH]2?|CL|F1?|W",
    "grease": r"MT\d+|LT\d*|LHT\d+|WT|GJN|HT\d*|GE\d*",
}
#: Suffixes that are harmless for one type only. Roller bearings of the reinforced
#: design E are those in the catalogue. Inserts have an inch bore, in sixteenths.
_ROLLER_DESIGN = r"EXL|E[CTWMJ]?1?[PJM]?A?|XL"
_OF_TYPES = {
    "cylindrical roller": _ROLLER_DESIGN,
    "spherical roller": _ROLLER_DESIGN,
    "insert ball": r"\d\d|D1|G2?|L3",
}


def catalogue_name(designation: str, types: Mapping[str, str]) -> str | None:
    """Return the name of a bearing in a catalogue, without its maker and suffixes.

    Parameters
    ----------
    designation : str
        Text on the bearing, such as "SKF 6205-2RS1/C3".
    types : mapping of str to str
        Type of each bearing in the catalogue, such as "deep-groove ball", by its name
        in upper case without spaces and hyphens.

    Returns
    -------
    str or None
        A name in the catalogue. None if the designation begins with none of them.

    Raises
    ------
    ValueError
        If a suffix is not known, because it may stand for other rolling elements.

    Examples
    --------
    >>> catalogue_name("SKF 6205-2RS1/C3", {"6205": "deep-groove ball"})
    '6205'
    >>> catalogue_name("62052", {"6205": "deep-groove ball"}) is None
    True
    """
    text = re.sub(_MAKERS, "", designation.strip().upper())
    parts = [part for part in re.split(r"[\s\-_/.]+", text) if part]
    for end in range(len(parts), 0, -1):
        joined = "".join(parts[:end])
        name = _longest_beginning(joined, types)
        if name is not None:
            suffixes = [joined.removeprefix(name), *parts[end:]]
            _check_suffixes(designation, name, suffixes, types[name])
            return name
    return None


def _longest_beginning(joined, names):
    """Return the longest name that a text begins with, and that no further digit follows."""
    fits = [
        name
        for name in names
        if joined.startswith(name) and not joined[len(name) :][:1].isdigit()
    ]
    return max(fits, key=len, default=None)


def _check_suffixes(designation, name, suffixes, kind):
    harmless = "|".join([*_SUFFIXES.values(), _OF_TYPES.get(kind, "(?!)")])
    for suffix in suffixes:
        if not re.fullmatch(f"(?:{harmless})*", suffix):
            raise ValueError(
                f"bearing {designation!r} is not known: the suffix {suffix} may stand for other "
                f"rolling elements or another contact angle. If it does not, give {name!r}. "
                "Otherwise give dimensions such as 9,7.94,39.04, or orders."
            )
