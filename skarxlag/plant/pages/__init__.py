"""Pages of HTML on recordings and models."""
