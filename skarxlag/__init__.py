"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators.

A name is imported from its module when it is first used, so that ``skarxlag --version``
and ``--help`` do not wait for numba. The stub ``__init__.pyi`` lists the names.
"""

from lazy_loader import attach_stub

from ._version import __version__ as __version__

__getattr__, __dir__, _names = attach_stub(__name__, __file__)
__all__ = [name for name in _names if name != "__version__"]
