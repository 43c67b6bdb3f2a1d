"""How a component becomes machine code."""
