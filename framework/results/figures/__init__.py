"""What is seen: curves, cracks, measures and the report."""
