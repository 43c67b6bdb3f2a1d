"""Figures: curves, cracks, measures and the report."""
