"""Where to draw; matplotlib is imported here and only when it is needed."""


def new_axes(n_rows):
    """Axes of a new pyplot figure, one above the other.

    Parameters
    ----------
    n_rows : int
        How many.

    Returns
    -------
    ndarray of matplotlib Axes of shape (n_rows,)
        They share their horizontal axis.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("Plotting needs matplotlib: pip install 'skarxlag[plot]'") from error
    _, axes = pyplot.subplots(n_rows, sharex=True, squeeze=False, layout="constrained")
    return axes[:, 0]
