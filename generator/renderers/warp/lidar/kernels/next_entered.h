#include "scene/kernels/simd.h"

const int count = groups.shape[0] / 6;
for (int b = after + 1; b < count; b += LANES - b % LANES) {
    const float* group = groups.data + 48 * (b / 8) + (LANES == 8 ? 0 : b % 8);
    const Floats none = 0.0f, never = FAR;
    Floats enter = none, leave = never;
    // As entry_distance.
    for (int k = 0; k < 3; ++k) {
        const Floats near = load(group + 16 * k, Floats()) - SLACK_M - origin_high_m[k];
        const Floats far = load(group + 16 * k + 8, Floats()) + SLACK_M - origin_low_m[k];
        const Floats forth = way_high[k] > 0.0f ? near / way_high[k] : never;
        const Floats back = way_low[k] < 0.0f ? far / way_low[k] : never;
        enter = larger(enter, near > none ? forth : far < none ? back : none);
        leave = smaller(leave, way_low[k] > 0.0f    ? far / way_low[k]
                               : way_high[k] < 0.0f ? near / way_high[k]
                                                    : never);
    }
    enter = enter * (1.0f - SLACK);
    const Floats reach = reach_m;
    const unsigned hits = bits(enter <= leave * (1.0f + SLACK)) & bits(enter < reach)
                          & ~0u << b % LANES;
    if (hits)
        return b - b % LANES + first_bit(hits);
}
return -1;
