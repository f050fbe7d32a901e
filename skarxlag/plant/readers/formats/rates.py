"""Agreement of sampling rates."""

from .facts import RATE_TOLERANCE, SECONDS

#: Error on a recording of unknown rate.
NO_RATE = "sampling_rate is missing; expected --sampling-rate, a column, or the file to state it"


def rates_agree(first: float | None, second: float | None) -> bool:
    """Return whether two sampling rates agree within the precision of clocks and files.

    Parameters
    ----------
    first, second : float or None
        In Hz. None, a rate that is not stated, agrees with every rate.

    Returns
    -------
    bool
        True up to a difference of 0.1 %.

    Examples
    --------
    >>> from skarxlag.plant.readers.formats.rates import rates_agree
    >>> rates_agree(51_199.87, 51_200), rates_agree(48_000, 51_200), rates_agree(None, 51_200)
    (True, False, True)
    """
    if first is None or second is None:
        return True
    return abs(first - second) <= RATE_TOLERANCE * max(first, second)


def unit_advice(rate: float, expected: float) -> str:
    """Return advice if a rate differs from the expected one by the factor of a unit of time.

    Examples
    --------
    >>> unit_advice(60_000, 1_000), unit_advice(1_500, 1_000)
    ("; times in min need the unit in their name: 'time (min)'", '')
    """
    for unit in ("min", "h", "ms", "us"):
        if abs(rate / expected / SECONDS[unit] - 1) < 0.01:
            return f"; times in {unit} need the unit in their name: 'time ({unit})'"
    return ""
