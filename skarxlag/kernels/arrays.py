"""Type of the arrays that kernels take and return."""

from typing import Any, TypeAlias

from numpy.typing import NDArray

# Array of numbers. The docstrings state shape and kind.
Array: TypeAlias = NDArray[Any]
