"""Vocabulary of native snippets that process eight numbers at once.

On the CPU, ``Lanes`` and ``Ints`` are eight numbers in the vector extensions of the compiler that
Warp ships: plain IEEE arithmetic, the same on every processor. On CUDA, where threads are lanes
themselves, they are one number, so that one source serves both.
"""

from __future__ import annotations

LANES = """
#ifdef __CUDA_ARCH__
    constexpr int WIDTH = 1;
    typedef float Lanes;
    typedef int Ints;
    auto load = [](const float* from) { return *from; };
    auto load_ints = [](const int* from) { return *from; };
    auto load_triples = [](const float* from, Lanes* to) {
        to[0] = from[0];
        to[1] = from[1];
        to[2] = from[2];
    };
    auto bits_of = [](bool condition) { return (unsigned)condition; };
    auto first_of = [](unsigned bits) { return 0; };
    auto at = [](Lanes lanes, int lane) { return lanes; };
#else
    constexpr int WIDTH = 8;
    typedef float Lanes __attribute__((ext_vector_type(8)));
    typedef float LanesInMemory __attribute__((ext_vector_type(8), aligned(4)));
    typedef int Ints __attribute__((ext_vector_type(8)));
    typedef int IntsInMemory __attribute__((ext_vector_type(8), aligned(4)));
    typedef bool Mask __attribute__((ext_vector_type(8)));
    auto load = [](const float* from) -> Lanes { return *(const LanesInMemory*)from; };
    auto load_ints = [](const int* from) -> Ints { return *(const IntsInMemory*)from; };
    // Eight vectors of three components, one after another, to their components.
    auto load_triples = [&](const float* from, Lanes* to) {
        const Lanes a = load(from), b = load(from + 8), c = load(from + 16);
        const Lanes x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, -1, -1);
        const Lanes y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, -1, -1, -1);
        const Lanes z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, -1, -1, -1);
        to[0] = __builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 10, 13);
        to[1] = __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 8, 11, 14);
        to[2] = __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 9, 12, 15);
    };
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
