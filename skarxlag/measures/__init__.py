"""Log spectra, envelope spectra, and the quality of windows."""
