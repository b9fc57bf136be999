"""Rasteriser, multisampling, cut-outs, silhouettes and label images."""
