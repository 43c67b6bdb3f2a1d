"""The machinery of the tessellators: cells that fill a region as convex polygons."""
