"""Checks, capabilities, fitted state, threads and speeds, which all estimators share."""
