"""How accuracy depends on what the paper leaves open."""
