// Samples a texture at four pixels at once, as ``texel_at``; on CUDA at one.

#if defined(__CUDA_ARCH__) || defined(AS_ON_GPU)
    constexpr int QUAD = 1;
    typedef float Floats;
    typedef int Ints;
    typedef unsigned Words;
    auto floats = [](Ints v) { return (float)v; };
    auto ints = [](Floats v) { return (int)v; };
    auto root = [](Floats v) { return sqrtf(v); };
    auto any = [](bool mask) { return mask; };
    auto get = [](auto v, int) { return v; };
    auto put = [](auto& v, int, auto value) { v = value; };
    auto lowest_bit = [](int bits) { return __ffs(bits) - 1; };
    auto weigh = [](Words pair, Words weight) { return pair * weight; };
#else
    constexpr int QUAD = 4;
    typedef float Floats __attribute__((ext_vector_type(4)));
    typedef int Ints __attribute__((ext_vector_type(4)));
    typedef unsigned Words __attribute__((ext_vector_type(4)));
    typedef unsigned short Halves __attribute__((ext_vector_type(8)));
    auto floats = [](Ints v) { return __builtin_convertvector(v, Floats); };
    auto ints = [](Floats v) { return __builtin_convertvector(v, Ints); };
    auto root = [](Floats v) { return __builtin_elementwise_sqrt(v); };
    auto any = [](Ints mask) { return __builtin_reduce_or(mask) != 0; };
    auto get = [](auto v, int k) { return v[k]; };
    auto put = [](auto& v, int k, auto value) { v[k] = value; };
    auto lowest_bit = [](int bits) { return __builtin_ctz(bits); };
    // Products of 16-bit halves take a fifth of the time of products of 32-bit integers.
    auto weigh = [](Words pair, Words weight) {
        return (Words)((Halves)pair * (Halves)(weight | weight << 16));
    };
#endif
    const Floats zero = 0.0f, one = 1.0f;
    // Selects by comparison: NaN is treated the same on every processor.
    auto smaller = [](Floats a, Floats b) -> Floats { return a < b ? a : b; };
    auto larger = [](Floats a, Floats b) -> Floats { return a > b ? a : b; };
    auto floor_ints = [&](Floats v) -> Ints {
        const Ints i = ints(v);
        return floats(i) > v ? i - 1 : i;
    };

    struct QuadTaps { int at[4][QUAD]; Words weights[4]; };
    struct Sample { Floats albedo[3], roughness, bump[3]; };

    // As taps_at.
    auto find_taps = [&](int first, int width, int height, Floats u, Floats v) {
        u = smaller(larger(u, -1.0e6f), 1.0e6f);
        v = smaller(larger(v, -1.0e6f), 1.0e6f);
        const Floats x = (u - floats(floor_ints(u))) * (float)width - 0.5f;
        const Floats y = (1.0f - (v - floats(floor_ints(v)))) * (float)height - 0.5f;
        Ints x0 = floor_ints(x), y0 = floor_ints(y);
        const Words right = (Words)ints((x - floats(x0)) * 256.0f);
        const Words down = (Words)ints((y - floats(y0)) * 256.0f);
        const Ints wide = width, high = height, none = 0;
        const Ints x1 = x0 + 1 >= wide ? none : x0 + 1, y1 = y0 + 1 >= high ? none : y0 + 1;
        x0 = x0 < none ? wide - 1 : x0 < wide ? x0 : wide - 1;
        y0 = y0 < none ? high - 1 : y0 < high ? y0 : high - 1;
        QuadTaps taps;
        for (int k = 0; k < QUAD; ++k) {
            const int upper = first + get(y0, k) * width, lower = first + get(y1, k) * width;
            taps.at[0][k] = upper + get(x0, k);
            taps.at[1][k] = upper + get(x1, k);
            taps.at[2][k] = lower + get(x0, k);
            taps.at[3][k] = lower + get(x1, k);
        }
        const Words both = weigh(right, down) >> 8;
        taps.weights[1] = right - both;
        taps.weights[2] = down - both;
        taps.weights[3] = both;
        taps.weights[0] = 256u - right - taps.weights[2];
        return taps;
    };

    // As mix_texels: four channels times FULL.
    auto mix_quad = [&](const unsigned* texels, const QuadTaps& taps, Floats* channels) {
        Words even = 0u, odd = 0u;
        for (int t = 0; t < 4; ++t) {
            Words texel;
            for (int k = 0; k < QUAD; ++k)
                put(texel, k, texels[taps.at[t][k]]);
            even += weigh(texel & 0x00FF00FFu, taps.weights[t]);
            odd += weigh(texel >> 8 & 0x00FF00FFu, taps.weights[t]);
        }
        channels[0] = floats((Ints)(even & 0xFFFFu));
        channels[1] = floats((Ints)(odd & 0xFFFFu));
        channels[2] = floats((Ints)(even >> 16));
        channels[3] = floats((Ints)(odd >> 16));
    };

    auto sample = [&](const auto& texture, const auto& sampler, Floats u, Floats v, bool bumpy) {
        constexpr float FULL = 65280.0f;
        const QuadTaps taps = find_taps(sampler.first, sampler.width, sampler.height, u, v);
        Floats c[4];
        Sample sampled;
        mix_quad(texture.texels.data, taps, c);
        if (bumpy) {
            Floats m[4];
            mix_quad(texture.bumps.data, taps, m);
            for (int k = 0; k < 3; ++k)
                sampled.bump[k] = m[k] * (2.0f / FULL) - 1.0f;
        }
        if (sampler.part > 0.0f) {
            const int width = sampler.width > 1 ? sampler.width >> 1 : 1;
            const int height = sampler.height > 1 ? sampler.height >> 1 : 1;
            Floats coarser[4];
            const QuadTaps upper = find_taps(sampler.coarser_first, width, height, u, v);
            mix_quad(texture.texels.data, upper, coarser);
            for (int k = 0; k < 4; ++k)
                c[k] = c[k] * (1.0f - sampler.part) + coarser[k] * sampler.part;
        }
        for (int k = 0; k < 4; ++k)
            c[k] = c[k] * (1.0f / FULL);
        for (int k = 0; k < 3; ++k)
            sampled.albedo[k] = c[k] * c[k];
        sampled.roughness = c[3];
        return sampled;
    };
