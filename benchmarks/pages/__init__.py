"""What writes tables and figures into the pages."""
