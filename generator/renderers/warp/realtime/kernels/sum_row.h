#include "realtime/kernels/window.h"

const float* given = values.data + j * points;
Floats total = 0.0f, count = 0.0f;
for (int k = -2; k <= 2; ++k) {
    const Points there = points_at(x + k, y);
    const Floats value = values_at(given, x + k, y), weight = rim_weight(k, 2);
    total += where_one(there, value != UNSEEN ? value * weight : zero);
    count += where_one(there, value != UNSEEN ? weight : zero);
}
write(sums.data + 2 * j * points, total);
write(sums.data + (2 * j + 1) * points, count);
