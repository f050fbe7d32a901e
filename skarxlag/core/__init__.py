"""What all estimators share: checks, capabilities, fitted state, threads and speeds."""
