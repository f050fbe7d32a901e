"""Pure numerics on arrays; nothing in here knows of scikit-learn."""
