"""Diagnosis of samples while they arrive."""
