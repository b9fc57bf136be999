"""Visible surfaces of all pixels, and the label images derived from them."""
