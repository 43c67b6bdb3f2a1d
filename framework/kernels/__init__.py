"""The compiled engine: numbers only, no objects."""
