"""One run: the parts of a running specimen, and the steps that move them."""
