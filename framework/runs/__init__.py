"""Runs: one test, several at a time, and sets of tests such as a strength envelope."""
