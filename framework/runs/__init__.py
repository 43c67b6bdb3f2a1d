"""Runs: one, several at a time, and those that answer one question."""
