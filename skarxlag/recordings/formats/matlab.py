"""MATLAB files up to version 7, which SciPy reads whole."""

import warnings

from scipy.io import loadmat

from ._channels import numeric_channels

SUFFIXES = (".mat",)


def blocks(path, n_samples):
    """One block of every numeric array."""
    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are no channels.
        warnings.simplefilter("ignore")
        content = loadmat(path, appendmat=False)
    yield numeric_channels(content), None
