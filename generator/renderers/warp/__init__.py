"""The renderer on NVIDIA Warp: one package per stage, kernels next to their host code."""
