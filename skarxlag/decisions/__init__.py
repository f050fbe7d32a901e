"""From distances, residual levels and orders to conditions and alarms."""
