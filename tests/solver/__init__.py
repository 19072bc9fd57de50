"""What proves the solver."""
