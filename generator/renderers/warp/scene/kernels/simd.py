"""Vocabulary of native snippets that process eight numbers at once.

On the CPU, ``Lanes`` are eight floats in the vector extensions of the compiler that Warp ships:
plain IEEE arithmetic, the same on every processor. On CUDA, where threads are lanes themselves, it
is one float, so that one source serves both.
"""

from __future__ import annotations

LANES = """
#ifdef __CUDA_ARCH__
    constexpr int WIDTH = 1;
    typedef float Lanes;
    auto load = [](const float* from) { return *from; };
    auto bits_of = [](bool condition) { return (unsigned)condition; };
    auto first_of = [](unsigned bits) { return 0; };
    auto at = [](Lanes lanes, int lane) { return lanes; };
#else
    constexpr int WIDTH = 8;
    typedef float Lanes __attribute__((ext_vector_type(8)));
    typedef float LanesInMemory __attribute__((ext_vector_type(8), aligned(4)));
    typedef bool Mask __attribute__((ext_vector_type(8)));
    auto load = [](const float* from) -> Lanes { return *(const LanesInMemory*)from; };
    // One bit per lane, from a comparison of lanes.
    auto bits_of = [](auto condition) {
        return (unsigned)__builtin_bit_cast(
            unsigned char, __builtin_convertvector(condition, Mask));
    };
    // The first lane whose bit is set.
    auto first_of = [](unsigned bits) { return __builtin_ctz(bits); };
    auto at = [](Lanes lanes, int lane) -> float { return lanes[lane]; };
#endif
    // Selects by comparison: NaN is treated the same on every processor.
    auto smaller = [](Lanes a, Lanes b) -> Lanes { return a < b ? a : b; };
    auto larger = [](Lanes a, Lanes b) -> Lanes { return a > b ? a : b; };
"""
"""Types and helpers; to be placed at the head of a snippet."""
