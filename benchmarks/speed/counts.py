"""How many multiply-adds the method needs for a sample."""


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
