"""How the defaults were chosen, and why they work."""
