"""Measures of windows: log spectra, envelope spectra, and the quality of a signal."""
