"""What the formats share: arrays and tables to named channels."""

import numpy as np


def slices(n_total, n_samples):
    """Slices that cover all samples; one empty slice where there is no sample."""
    step = max(n_total if n_samples is None else n_samples, 1)
    return (slice(start, start + step) for start in range(0, max(n_total, 1), step))


def numeric_channels(content):
    """Channels of all numeric arrays of more than one value, by the name of the variable."""
    channels = {}
    for name, values in content.items():
        if isinstance(values, np.ndarray) and values.dtype.kind in "fiuc" and values.size > 1:
            channels |= split_matrix(name, values)
    return channels


def split_matrix(name, values):
    """Channels of one array: its rows or its columns, whichever are longer."""
    values = np.squeeze(values) if values.size > 1 else values.reshape(-1)
    if values.ndim == 1:
        return {name or "0": values}
    if values.ndim > 2 or values.shape[0] == values.shape[1]:
        raise ValueError(
            f"array {name!r} of shape {values.shape}: expected a vector, or a matrix that is "
            "longer in time than in channels"
        )
    rows = values if values.shape[0] < values.shape[1] else values.T
    return {f"{name}[{i}]" if name else str(i): row for i, row in enumerate(rows)}


def columns(frame):
    """Columns of a table by their names, as texts."""
    return {str(name): frame.iloc[:, i] for i, name in enumerate(frame.columns)}
