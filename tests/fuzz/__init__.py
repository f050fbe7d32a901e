"""Damaged files for every reader of recordings and for models: ``python -m tests.fuzz``."""
