"""From windows to innovations, and from innovations to levels and log spectra."""
