"""One answer for each window and for each recording."""
