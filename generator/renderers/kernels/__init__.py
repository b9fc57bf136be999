"""Warp kernels: the inner loops of the renderer, the same source for CPU and CUDA.

Every kernel but the rasteriser's is free of races, so that it may run in any order; the
rasteriser relies on the CPU device running its bodies one after the other.
"""
