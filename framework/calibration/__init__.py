"""Contact parameters of a rock from its laboratory tests, and which of them the tests determine."""
