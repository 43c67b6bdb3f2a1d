"""What remains of a run: curves, cracks, measures, files."""
