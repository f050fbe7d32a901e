"""What all transformers share that give arrays of three axes."""

from typing import Any, Self

from sklearn.base import BaseEstimator, TransformerMixin

from ._documentation import DocumentedEstimator


class ArrayTransformer(
    DocumentedEstimator, TransformerMixin, BaseEstimator, auto_wrap_output_keys=None
):
    """A transformer whose output has three axes, so that it is an array whatever the setting."""

    def set_output(self, *, transform: str | None = None) -> Self:
        """Accept the setting and keep returning arrays: they have three axes, tables have two.

        It is here so that ``Pipeline.set_output`` reaches the steps that do return tables.

        Parameters
        ----------
        transform : {"default", "pandas", "polars"} or None, default=None
            Ignored.

        Returns
        -------
        estimator
            This transformer.
        """
        return self

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags
