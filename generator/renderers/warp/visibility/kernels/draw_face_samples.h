#include "scene/kernels/simd.h"
#include "visibility/kernels/solid.h"
#include "visibility/kernels/scan.h"

constexpr int SAMPLES_MAX = 8;
constexpr double FAR = 1.0e18;
constexpr float FROM_GRID = 0.00390625f;  // offsets are in steps of 1/256 px
const int samples = offsets.shape[1];
const FloatQuad low = plane.low, high = plane.high;
const long long hit = (unsigned)body | (long long)face << 32;
// Largest change of 1/z from a pixel's centre to its corner.
const float dx = plane.dx, dy = plane.dy;
const float slack = 0.5f * ((dx < 0.0f ? -dx : dx) + (dy < 0.0f ? -dy : dy));

// Changes of the edge functions from a pixel's centre to its samples, and the largest of them.
struct { DoubleQuad a, b, c; FloatQuad right, down; } changes[SAMPLES_MAX / QUAD];
Values reach = {-FAR, -FAR, -FAR};
for (int s = 0; s < samples; s += QUAD) {
    auto& change = changes[s / QUAD];
    const IntQuad right = load(offsets.data + s, IntQuad());
    const IntQuad down = load(offsets.data + samples + s, IntQuad());
    auto between = [&](const auto& edge, double& most) {
        const DoubleQuad steps = doubles(right) * (double)(edge.dx >> 8)
            + doubles(down) * (double)(edge.dy >> 8);
        most = greatest(most, steps);
        return steps;
    };
    change.a = between(edges.a, reach.a);
    change.b = between(edges.b, reach.b);
    change.c = between(edges.c, reach.c);
    change.right = floats(right) * FROM_GRID;
    change.down = floats(down) * FROM_GRID;
}
for (int s = 0; s < samples; s += QUAD) {
    changes[s / QUAD].a -= reach.a;
    changes[s / QUAD].b -= reach.b;
    changes[s / QUAD].c -= reach.c;
}

auto limits = [&](int x, int y) { return load(floors.data + y * stride + x, Floats()); };
auto matter = [&](int x, int y) { return bits(limits(x, y) <= Floats(plane.high)); };
scan(reach, matter, [&](int x, int y, unsigned reached, auto at) {
    const float row_centre = plane.c + (float)y * dy;
    const Floats centres = row_centre + (lane + (float)x) * dx;
    // No sample is nearer than this.
    const Floats bound = larger(centres + slack, plane.low);
    unsigned left = reached & bits(limits(x, y) <= bound);
    for (; left; left &= left - 1) {
        const int pixel = first_bit(left);
        const int first = numbers.data[y * stride + x + pixel] * samples;
        unsigned changed = 0;
        const Values values = at(pixel);
        const float centre = row_centre + (float)(x + pixel) * dx;
        for (int s = 0; s < samples; s += QUAD) {
            const auto& change = changes[s / QUAD];
            const DoubleQuad inside = least(
                change.a + values.a, least(change.b + values.b, change.c + values.c));
            const int row = first + s;
            const FloatQuad w = clamped(
                centre + (change.right * dx + change.down * dy), low, high);
            // One branch for both tests: it cannot be predicted.
            unsigned drawn = bits(inside >= DoubleQuad(0.0))
                & bits(w > load(nearness.data + row, w));
            if (drawn)
                drawn = solid(drawn, change.right + ((float)(x + pixel) + 0.5f),
                              change.down + ((float)y + 0.5f), w);
            if (drawn) {
                put(nearness.data + row, drawn, w);
                put(hits.data + row, drawn, LongQuad(hit));
                changed = drawn;
            }
        }
        // Surfaces behind all samples of a pixel need no further test.
        if (changed) {
            float farthest = nearness.data[first];
            for (int s = 1; s < samples; ++s)
                farthest = least(farthest, nearness.data[first + s]);
            float& floor = floors.data[y * stride + x + pixel];
            floor = floor < farthest ? farthest : floor;
        }
    }
});
