#include "scene/kernels/simd.h"

const int count = boxes.shape[0] / 6;
for (int b = after + 1; b < count; b += LANES - b % LANES) {
    const float* group = boxes.data + 48 * (b / 8) + (LANES == 8 ? 0 : b % 8);
    // Parameters between which the axis is inside of the boxes, enlarged by a radius.
    auto overlap = [&](Floats grown, Floats& enters, Floats& leaves) {
        enters = 0.0f;
        leaves = 1.0f;
        for (int k = 0; k < 3; ++k) {
            const Floats from = load(group + 16 * k, Floats()) - start[k];
            const Floats to = load(group + 16 * k + 8, Floats()) - start[k];
            const Floats low = (from - grown) * inverse[k];
            const Floats high = (to + grown) * inverse[k];
            enters = larger(enters, smaller(low, high));
            leaves = smaller(leaves, larger(low, high));
        }
    };
    // First with the wider end's radius, then with that where the shaft may touch them.
    const Floats widest = larger(radius, end_radius), widening = end_radius - radius;
    Floats enters, leaves;
    overlap(widest, enters, leaves);
    const Floats grown = radius + larger(widening * enters, widening * leaves);
    overlap(smaller(grown, widest), enters, leaves);
    const unsigned hits = bits(enters <= leaves) & ~0u << b % LANES;
    if (hits)
        return b - b % LANES + first_bit(hits);
}
return -1;
