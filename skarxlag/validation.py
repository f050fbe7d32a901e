"""Checks that several estimators share."""

import numpy as np


def check_input_names(estimator, input_features):
    """Names of the features that an estimator was fitted on.

    Parameters
    ----------
    estimator : estimator
        Fitted; has `n_features_in_`, and `feature_names_in_` when it was fitted on a table.
    input_features : array-like of str or None
        What the caller says that they are called.

    Returns
    -------
    ndarray of str or None
        `input_features`, or `feature_names_in_`; None where neither is there.

    Raises
    ------
    ValueError
        If the names do not agree with what the estimator was fitted on.
    """
    known = getattr(estimator, "feature_names_in_", None)
    if input_features is None:
        return known
    input_features = np.asarray(input_features, dtype=object)
    if known is not None and not np.array_equal(known, input_features):
        raise ValueError("input_features is not equal to feature_names_in_")
    if len(input_features) != estimator.n_features_in_:
        raise ValueError(
            "input_features should have length equal to number of features "
            f"({estimator.n_features_in_}), got {len(input_features)}"
        )
    return input_features
