"""The renderer on NVIDIA Warp: one room per stage, kernels beside their host code."""
