// Vocabulary of native code that handles several pixels or samples at once.
// On the CPU, a vector has eight lanes (LANES), a quad four (QUAD); both are extension types of the
// compiler that Warp ships: plain IEEE arithmetic, the same on every processor. On CUDA the same text
// compiles to one lane per thread. Unused names cost nothing. Compiled with AS_ON_GPU, the CPU takes
// the text of CUDA too: tests do so without a GPU.

#if defined(__CUDA_ARCH__) || defined(AS_ON_GPU)
    constexpr int LANES = 1, QUAD = 1;
    typedef float Floats, FloatQuad;
    typedef double Doubles, DoubleQuad;
    typedef int Ints, IntQuad;
    typedef long long Longs, LongQuad;
    typedef unsigned char Bytes;
    const float lane = 0.0f;
    auto bits = [](bool truth) { return (unsigned)truth; };
    auto first_bit = [](unsigned set) { return __ffs(set) - 1; };
    auto floats = [](int v) { return (float)v; };
    auto doubles = [](auto v) { return (double)v; };
    auto ints = [](float v) { return (int)v; };
    auto load = [](const void* memory, auto like) { return *(const decltype(like)*)memory; };
    auto put = [](void* memory, unsigned set, auto value) {
        if (set)
            *(decltype(value)*)memory = value;
    };
    auto gather = [](const auto* array, int i) { return (int)array[i]; };
    auto greatest = [](double number, double v) { return number > v ? number : v; };
    auto at = [](auto value, int) { return value; };
    auto load_triples = [](const float* memory, Floats* components) {
        for (int k = 0; k < 3; ++k)
            components[k] = memory[k];
    };
#else
    constexpr int LANES = 8, QUAD = 4;
    typedef float Floats __attribute__((ext_vector_type(8)));
    typedef double Doubles __attribute__((ext_vector_type(8)));
    typedef int Ints __attribute__((ext_vector_type(8)));
    typedef long long Longs __attribute__((ext_vector_type(8)));
    typedef unsigned char Bytes __attribute__((ext_vector_type(8)));
    typedef float FloatQuad __attribute__((ext_vector_type(4)));
    typedef double DoubleQuad __attribute__((ext_vector_type(4)));
    typedef int IntQuad __attribute__((ext_vector_type(4)));
    typedef long long LongQuad __attribute__((ext_vector_type(4)));
    const Floats lane = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    // The lanes at which a comparison holds, as a set: one bit each, the first lane lowest.
    auto bits = [](auto truth) {
        typedef bool Bools __attribute__((ext_vector_type(8)));
        typedef bool BoolQuad __attribute__((ext_vector_type(4)));
        if constexpr (sizeof(truth) / sizeof(truth[0]) == 8)
            return (unsigned)__builtin_bit_cast(
                unsigned char, __builtin_convertvector(truth < 0, Bools));
        else
            return (unsigned)__builtin_bit_cast(
                unsigned char, __builtin_convertvector(truth < 0, BoolQuad)) & 15u;
    };
    auto first_bit = [](unsigned set) { return __builtin_ctz(set); };
    auto floats = [](auto v) {
        if constexpr (sizeof(v) / sizeof(v[0]) == 8)
            return __builtin_convertvector(v, Floats);
        else
            return __builtin_convertvector(v, FloatQuad);
    };
    auto doubles = [](auto v) {
        if constexpr (sizeof(v) / sizeof(v[0]) == 8)
            return __builtin_convertvector(v, Doubles);
        else
            return __builtin_convertvector(v, DoubleQuad);
    };
    // Truncated towards zero, as casts are.
    auto ints = [](auto v) { return __builtin_convertvector(v, decltype(v < v)); };
    // Of the lanes of a set ``a``, of others ``b``.
    auto chosen = [](unsigned set, auto a, auto b) {
        typedef decltype(a < b) Integers;
        if constexpr (sizeof(a) / sizeof(a[0]) == 8)
            return (Integers(set) & Integers{1, 2, 4, 8, 16, 32, 64, 128}) != 0 ? a : b;
        else
            return (Integers(set) & Integers{1, 2, 4, 8}) != 0 ? a : b;
    };
    // The largest of a number and a quad.
    auto greatest = [](double number, DoubleQuad v) {
        for (int k = 0; k < 4; ++k)
            number = v[k] > number ? v[k] : number;
        return number;
    };
    // Elements of an array of integers.
    auto gather = [](const auto* array, auto i) {
        if constexpr (sizeof(i) / sizeof(i[0]) == 8)
            return Ints{array[i[0]], array[i[1]], array[i[2]], array[i[3]],
                        array[i[4]], array[i[5]], array[i[6]], array[i[7]]};
        else
            return IntQuad{array[i[0]], array[i[1]], array[i[2]], array[i[3]]};
    };
    // As many elements of an array as ``like`` has, from any address.
    auto load = [](const void* memory, auto like) {
        __builtin_memcpy(&like, memory, sizeof(like));
        return like;
    };
    // Write the lanes of a set.
    auto put = [&](void* memory, unsigned set, auto value) {
        value = chosen(set, value, load(memory, value));
        __builtin_memcpy(memory, &value, sizeof(value));
    };
    auto at = [](auto vector, int k) { return vector[k]; };
    // Eight triples of floats, one after another, to their components.
    auto load_triples = [&](const float* memory, Floats* components) {
        const Floats a = load(memory, Floats()), b = load(memory + 8, Floats());
        const Floats c = load(memory + 16, Floats());
        const Floats x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, -1, -1);
        const Floats y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, -1, -1, -1);
        const Floats z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, -1, -1, -1);
        components[0] = __builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 10, 13);
        components[1] = __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 8, 11, 14);
        components[2] = __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 9, 12, 15);
    };
#endif
    // The first ``n`` lanes, of which there may be fewer.
    auto first_bits = [](int n) { return n < LANES ? (1u << n) - 1u : ~0u; };
    auto least = [](auto a, auto b) { return a < b ? a : b; };
    // A single float stands for a vector of them.
    auto smaller = [](Floats a, Floats b) -> Floats { return a < b ? a : b; };
    auto larger = [](Floats a, Floats b) -> Floats { return a > b ? a : b; };
    auto clamped = [](auto v, auto low, auto high) {
        // NaN becomes the low end.
        const auto raised = v > low ? v : low;
        return raised < high ? raised : high;
    };
