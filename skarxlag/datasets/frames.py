"""Forms in which a rig is returned: a Bunch, with a table of facts, or two arrays."""

from typing import Any

import pandas as pd
from sklearn.utils import Bunch

#: Facts of each window, in the order in which splitters take them as `groups`.
FACTS = ("rpm", "recording", "start", "specimen", "load")


def in_form(rig: Bunch, *, return_X_y: bool, as_frame: bool) -> Any:
    """Return a rig in the form that was asked for, as the loaders of scikit-learn do.

    Parameters
    ----------
    rig : Bunch
        Windows and their facts.
    return_X_y : bool
        Whether to return windows and conditions alone.
    as_frame : bool
        Whether to add ``frame``, a table with the facts of each window.

    Returns
    -------
    Bunch, or tuple of (ndarray, ndarray)
        The rig.

    Examples
    --------
    >>> rig = Bunch(data=[[0.0, 1.0]], target=["worn"], rpm=[900.0], recording=["run"])
    >>> in_form(rig, return_X_y=True, as_frame=False)
    ([[0.0, 1.0]], ['worn'])
    >>> in_form(rig, return_X_y=False, as_frame=True).frame
         rpm recording
    0  900.0       run
    """
    if return_X_y:
        return rig.data, rig.target
    if as_frame:
        stated = {name: rig[name] for name in FACTS if rig.get(name) is not None}
        rig.frame = pd.DataFrame(stated)
    return rig
