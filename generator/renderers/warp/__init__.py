"""The renderer on NVIDIA Warp: one package per stage, kernels beside their host code."""
