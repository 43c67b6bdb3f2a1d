"""What pictures are drawn on, and pictures of grains."""
