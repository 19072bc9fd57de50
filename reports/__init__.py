"""Tables, figures and pages from result files; nothing here recomputes a result."""
