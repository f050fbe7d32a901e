"""Pure numerics on arrays; none of them uses scikit-learn."""
