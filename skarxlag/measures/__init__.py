"""What is measured in windows: log spectra, envelope spectra, and the quality of a signal."""
