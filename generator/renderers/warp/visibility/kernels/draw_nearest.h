#include "scene/kernels/simd.h"
#include "visibility/kernels/solid.h"
#include "visibility/kernels/scan.h"

const Floats low = plane.low, high = plane.high;
const long long hit = (unsigned)body | (long long)face << 32;
auto nearest = [&](int x, int y) { return load(nearness.data + y * stride + x, Floats()); };
auto matter = [&](int x, int y) { return bits(nearest(x, y) < high); };
scan({}, matter, [&](int x, int y, unsigned inside, auto) {
    const Floats xs = lane + (float)x;
    const Floats w = clamped(plane.c + (float)y * plane.dy + xs * plane.dx, low, high);
    unsigned drawn = inside & bits(w > nearest(x, y));
    if (drawn)
        drawn = solid(drawn, xs + 0.5f, Floats((float)y + 0.5f), w);
    if (drawn) {
        put(nearness.data + y * stride + x, drawn, w);
        put(hits.data + y * stride + x, drawn, Longs(hit));
    }
});
