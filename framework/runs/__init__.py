"""Runs: one test, several at a time."""
