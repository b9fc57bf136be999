#include "realtime/kernels/window.h"

auto sum_column = [&](int half, Floats& total, Floats& count) {
    total = 0.0f;
    count = 0.0f;
    for (int k = -half; k <= half; ++k) {
        const Points there = points_at(x, y + k);
        const Floats weight = rim_weight(k, half);
        const float* given = sums.data + 2 * j * points;
        total += where_one(there, values_at(given, x, y + k) * weight);
        count += where_one(there, values_at(given + points, x, y + k) * weight);
    }
};
Floats total, count, wide_total, wide_count;
sum_column(2, total, count);
const Floats value = values_at(values.data + j * points, x, y), limit = enough;
const auto lacks = (value != UNSEEN) & (count < limit);
if (bits(lacks)) {
    // At the end of a surface a window holds part of the pattern only: take a larger one.
    sum_column(4, wide_total, wide_count);
    total = lacks ? wide_total : total;
    count = lacks ? wide_count : count;
}
const auto known = (value != UNSEEN) & (count > zero);
write(smoothed.data + j * points, known ? total / count : value);
