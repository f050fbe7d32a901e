"""Settings that must stand before SciPy is imported."""

import os

# scikit-learn skips its array API check where SciPy was imported without this.
os.environ.setdefault("SCIPY_ARRAY_API", "1")
