"""Model-based fault diagnosis of bearings across shaft speeds."""

__version__ = "0.1.0"
