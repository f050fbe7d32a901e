"""How many multiply-adds the method needs for a sample."""

import math


def multiply_adds(order, n_models, n_inputs=0):
    r"""Count the multiply-adds per sample of a bank with the extended-state observer after it.

    A multiply-add is one multiplication with the addition that follows it, as in a
    matrix product. An addition, subtraction, comparison, size or choice without a
    multiplication takes the same place in a processor and counts as one. Not counted:
    moving data, what is done once for a window, and whatever an implementation does
    beyond these equations.

    Parameters
    ----------
    order : int
        Laguerre filters N on each channel.
    n_models : int
        Models C of the bank.
    n_inputs : int, default=0
        Number of measured inputs.

    Returns
    -------
    dict of str to int
        ``scaling``, a channel: its sum, less the mean, its sum of squares, times the
        scale (4). ``cascade``, a channel: :math:`x_0^+ = \zeta x_0 +
        \sqrt{1-\zeta^2}\,s` and :math:`x_n^+ = x_{n-1} + \zeta (x_n - x_{n-1}^+)` (2
        each, 2N). ``prediction``, a model: :math:`\varepsilon = y - g^T x` (N a
        channel). ``observer``, a model: :math:`e = \varepsilon - c` (1), :math:`c^+ =
        \zeta c + k_p e + \hat\delta` (2), :math:`S = p + k_{Ib} e` (1),
        :math:`\min(|S|, M)` (2), :math:`p^+ = p + k_{Ia} e` (1) and :math:`\hat\delta^+
        = (K_c + K_c |S|) p^+` with :math:`\kappa = 1` (2). ``surface``, a model:
        :math:`\lambda e + (e - e(k-1))` (2). ``gain``, a model: sum of squares that
        starts it (1), size of the surface (1), two comparisons, choice of the factor
        and the product (4), sum of its logarithm (1).

    Examples
    --------
    >>> multiply_adds(order=16, n_models=8)
    {'scaling': 4, 'cascade': 32, 'prediction': 128, 'observer': 72, 'surface': 16, 'gain': 56}
    >>> sum(multiply_adds(order=16, n_models=8).values())
    308
    """
    n_channels = 1 + n_inputs
    return {
        "scaling": 4 * n_channels,
        "cascade": 2 * order * n_channels,
        "prediction": order * n_channels * n_models,
        "observer": 9 * n_models,
        "surface": 2 * n_models,
        "gain": 7 * n_models,
    }


def linear_multiply_adds(order, n_models):
    r"""Count the multiply-adds per sample of a bank of models with a linear observer each.

    Parameters
    ----------
    order : int
        Laguerre filters N of the output.
    n_models : int
        Models of the bank.

    Returns
    -------
    dict of str to int
        ``scaling``, ``cascade`` and ``prediction`` as `multiply_adds` returns them.
        ``observer``, a model: :math:`e = \varepsilon - c` (1), :math:`c^+ = \zeta c +
        k_p e + p` (2), :math:`p^+ = p + k_I e` (1), sum of :math:`e^2` (1).

    Examples
    --------
    >>> linear_multiply_adds(order=16, n_models=4)
    {'scaling': 4, 'cascade': 32, 'prediction': 64, 'observer': 20}
    """
    model = multiply_adds(order, n_models)
    counts = {name: model[name] for name in ("scaling", "cascade", "prediction")}
    return counts | {"observer": 5 * n_models}


def bank_multiply_adds(order, n_members):
    r"""Count the multiply-adds per sample of one model and a bank of observers after it.

    Parameters
    ----------
    order : int
        Laguerre filters N of the output.
    n_members : int
        Members of the bank.

    Returns
    -------
    dict of str to int
        ``scaling``, ``cascade`` and ``prediction`` as `multiply_adds` returns them.
        ``estimate``, a member: :math:`e = \varepsilon - c` (1), :math:`c^+ = \zeta c +
        k_p e + d` (1, as a e - d), :math:`p^+ = p + k_I e` (1), :math:`\min(|p|, M)`
        (2), :math:`d = (1 + \min(|p|, M)) p` (1), sum of :math:`d^2` (1). ``gain``, a
        member: comparison, choice of the factor, product, sum of its logarithm, and the
        sum of these sums (5).

    Examples
    --------
    >>> bank_multiply_adds(order=16, n_members=64)
    {'scaling': 4, 'cascade': 32, 'prediction': 16, 'estimate': 448, 'gain': 320}
    """
    counts = linear_multiply_adds(order, 1)
    counts.pop("observer")
    return counts | {"estimate": 7 * n_members, "gain": 5 * n_members}


def spectra_multiply_adds(order, n_samples):
    r"""Count the multiply-adds per sample of one model and the log spectra after it.

    A window has n samples, p = n / 8 coefficients of its own model, but at most 128,
    and S segments of L = 128 samples that start L / 8 samples apart. A transform of L
    real values takes :math:`\tfrac{5}{4} L \log_2 L`, half of the operations of a
    complex transform with two-point butterflies. Not counted: what `multiply_adds` does
    not count, the median, and the comparison with conditions.

    Parameters
    ----------
    order : int
        Laguerre filters of the output.
    n_samples : int
        Innovations of a window, at least 128.

    Returns
    -------
    dict of str to int
        ``scaling``, ``cascade`` and ``prediction`` as `multiply_adds` returns them.
        ``lags``: sums of products, :math:`(n - p)(p + 1)`. ``factor``: three rotations
        of two entries each, :math:`12 p (p + 1) / 2`. ``substitution``: :math:`p (p +
        1) / 2`. ``segments``: window, transform and power, :math:`S (L + \tfrac{5}{4} L
        \log_2 L + L)`.

    Examples
    --------
    >>> counts = spectra_multiply_adds(order=4, n_samples=1200)
    >>> counts["lags"], counts["factor"], counts["segments"]
    (115, 83, 78)
    """
    segment, spectrum_order = 128, min(n_samples // 8, 128)
    n_segments = (n_samples - segment) // (segment // 8) + 1
    transform = 5 / 4 * segment * math.log2(segment)
    of_window = {
        "lags": (n_samples - spectrum_order) * (spectrum_order + 1),
        "factor": 6 * spectrum_order * (spectrum_order + 1),
        "substitution": spectrum_order * (spectrum_order + 1) / 2,
        "segments": n_segments * (2 * segment + transform),
    }
    counts = linear_multiply_adds(order, 1)
    counts.pop("observer")
    return counts | {name: round(n / n_samples) for name, n in of_window.items()}
