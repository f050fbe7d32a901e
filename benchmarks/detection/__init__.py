"""Detection from healthy recordings: rates, peers, runs to failure, conditions never seen."""
