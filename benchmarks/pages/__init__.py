"""Commands that write the tables and figures of the documentation."""
