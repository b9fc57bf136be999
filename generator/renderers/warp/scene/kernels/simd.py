"""Vocabulary of native code that handles several pixels or samples at once.

On the CPU, a vector has eight lanes (LANES), a quad four (QUAD); both are extension types of the
compiler that Warp ships: plain IEEE arithmetic, the same on every processor. On CUDA the same text
compiles to one lane per thread. A native function begins with ``SIMD``; unused names cost nothing.

Masks are what comparisons return; ``mask ? a : b`` selects by lane.
"""

from __future__ import annotations

LANES = 8
"""Lanes of a vector on the CPU: arrays that vectors are written to are that much longer."""

SIMD = """
#ifdef __CUDA_ARCH__
    constexpr int LANES = 1, QUAD = 1;
    typedef float Floats, FloatsInMemory, FloatQuad, FloatQuadInMemory;
    typedef int Ints, IntQuad, IntQuadInMemory;
    typedef double Doubles, DoubleQuad;
    typedef long long LongsInMemory, LongQuadInMemory;
    typedef unsigned char BytesInMemory;
    const Ints lane = 0;
    const Doubles lane_double = 0.0;
    auto bits = [](bool mask) { return (unsigned)mask; };
    auto floats = [](int v) { return (float)v; };
    auto ints = [](float v) { return (int)v; };
    auto as_ints = [](bool mask) { return mask; };
    auto as_longs = [](bool mask) { return mask; };
    auto as_bytes = [](bool mask) { return (unsigned char)mask; };
    auto from_bits = [](unsigned set, int) { return set != 0; };
    auto doubles = [](int v) { return (double)v; };
    const IntQuad quad_lane = 0;
    auto get = [](auto v, int) { return v; };
    auto first_bit = [](unsigned set) { return __ffs(set) - 1; };
#else
    constexpr int LANES = 8, QUAD = 4;
    typedef float Floats __attribute__((ext_vector_type(8)));
    typedef int Ints __attribute__((ext_vector_type(8)));
    typedef double Doubles __attribute__((ext_vector_type(8)));
    typedef long long Longs __attribute__((ext_vector_type(8)));
    typedef unsigned char Bytes __attribute__((ext_vector_type(8)));
    typedef float FloatQuad __attribute__((ext_vector_type(4)));
    typedef int IntQuad __attribute__((ext_vector_type(4)));
    typedef double DoubleQuad __attribute__((ext_vector_type(4)));
    typedef long long LongQuad __attribute__((ext_vector_type(4)));
    // Elements of arrays, at any index.
    typedef Floats FloatsInMemory __attribute__((aligned(4), may_alias));
    typedef Longs LongsInMemory __attribute__((aligned(4), may_alias));
    typedef Bytes BytesInMemory __attribute__((aligned(1), may_alias));
    typedef FloatQuad FloatQuadInMemory __attribute__((aligned(4), may_alias));
    typedef IntQuad IntQuadInMemory __attribute__((aligned(4), may_alias));
    typedef LongQuad LongQuadInMemory __attribute__((aligned(4), may_alias));
    const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
    const Doubles lane_double = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    // One bit per lane, the first lane lowest.
    auto bits = [](auto mask) {
        typedef bool Bools __attribute__((ext_vector_type(8)));
        typedef bool BoolQuad __attribute__((ext_vector_type(4)));
        if constexpr (sizeof(mask) / sizeof(mask[0]) == 8)
            return (unsigned)__builtin_bit_cast(
                unsigned char, __builtin_convertvector(mask, Bools));
        else
            return (unsigned)__builtin_bit_cast(
                unsigned char, __builtin_convertvector(mask, BoolQuad)) & 15u;
    };
    auto floats = [](auto v) {
        if constexpr (sizeof(v) / sizeof(v[0]) == 8)
            return __builtin_convertvector(v, Floats);
        else
            return __builtin_convertvector(v, FloatQuad);
    };
    // Truncated towards zero, as casts are.
    auto ints = [](auto v) { return __builtin_convertvector(v, decltype(v < v)); };
    // Masks for elements of other sizes.
    auto as_ints = [](auto mask) {
        if constexpr (sizeof(mask) / sizeof(mask[0]) == 8)
            return __builtin_convertvector(mask, Ints);
        else
            return __builtin_convertvector(mask, IntQuad);
    };
    auto as_longs = [](auto mask) {
        if constexpr (sizeof(mask) / sizeof(mask[0]) == 8)
            return __builtin_convertvector(mask, Longs);
        else
            return __builtin_convertvector(mask, LongQuad);
    };
    auto as_bytes = [](Ints mask) { return __builtin_convertvector(mask, Bytes); };
    // The inverse of ``bits``, for vectors (of ``lane``) or quads (of ``quad_lane``).
    auto from_bits = [](unsigned set, auto lanes) {
        return ((decltype(lanes)(set) >> lanes) & 1) != 0;
    };
    auto doubles = [](IntQuad v) { return __builtin_convertvector(v, DoubleQuad); };
    const IntQuad quad_lane = {0, 1, 2, 3};
    auto get = [](auto v, int k) { return v[k]; };
    auto first_bit = [](unsigned set) { return __builtin_ctz(set); };
#endif
    auto least = [](auto a, auto b) { return a < b ? a : b; };
    auto clamped = [](auto v, auto low, auto high) {
        // NaN becomes the low end.
        const auto raised = v > low ? v : low;
        return raised < high ? raised : high;
    };
"""
