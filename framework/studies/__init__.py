"""Many runs as cases of one study: design, workers, store, table."""
