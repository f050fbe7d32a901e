"""Recordings that `signal_quality` refuses: good ones behind other sensors, and damaged ones."""
