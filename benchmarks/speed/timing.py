"""Times of functions that are called in turn, with the rate of a matrix product."""

import time

import numpy as np

#: Size of the matrices of the product that measures the rate of multiply-adds.
MATRIX_SIDE = 768


def take_turns(functions, n_rounds, clock=time.process_time):
    """Return the seconds of each function, called one after another in every round.

    Parameters
    ----------
    functions : dict of str to callable
        What is timed; each is called once before, to compile and to fill caches.
    n_rounds : int
        Rounds. What slows the machine down for a while slows all functions of a round
        alike, so ratios are taken within a round.
    clock : callable, default=time.process_time
        Seconds. Processor time leaves out what other processes on the machine take; on
        one thread of an idle machine it is the time that passes.

    Returns
    -------
    dict of str to ndarray of shape (n_rounds,)
        Seconds.
    """
    for function in functions.values():
        function()
    seconds = {name: np.empty(n_rounds) for name in functions}
    for turn in range(n_rounds):
        for name, function in functions.items():
            start = clock()
            function()
            seconds[name][turn] = clock() - start
    return seconds


def ratio(above, below):
    """Return the median of the ratios within a round, and their spread.

    Parameters
    ----------
    above, below : ndarray of shape (n_rounds,)
        Seconds of two functions, as `take_turns` returns them.

    Returns
    -------
    median : float
        Of above / below.
    spread : float
        Half the range between the quartiles, as a share of the median.

    Examples
    --------
    >>> ratio(np.array([2.0, 4.0, 8.0]), np.array([1.0, 2.0, 4.0]))
    (2.0, 0.0)
    """
    ratios = above / below
    return float(np.median(ratios)), spread(ratios)


def spread(values):
    """Return half the range between the quartiles, as a share of the median."""
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
    return float((high - low) / (2 * median))


def matrix_product():
    """A float64 matrix product of NumPy, and the multiply-adds that it makes."""
    left, right = np.random.default_rng(0).normal(size=(2, MATRIX_SIDE, MATRIX_SIDE))
    return lambda: left @ right, MATRIX_SIDE**3
