#include "scene/kernels/simd.h"
#include "visibility/kernels/solid.h"
#include "visibility/kernels/scan.h"

const auto& window = outline.window;
const Floats low = plane.low, high = plane.high;
auto pixels = [&](int x, int y) {
    return mask.data + outline.first_pixel + y * outline.stride + x;
};
auto matter = [&](int x, int y) { return bits(load(pixels(x, y), Bytes()) == Bytes(0)); };
scan({}, matter, [&](int x, int y, unsigned inside, auto) {
    if (cutout.texture >= 0) {
        const Floats xs = lane + (float)x;
        const Floats w = clamped(plane.c + (float)y * plane.dy + xs * plane.dx, low, high);
        const Floats x_px = lane + ((float)(x + window.x0) + 0.5f);
        inside = solid(inside, x_px, Floats((float)(y + window.y0) + 0.5f), w);
    }
    if (inside)
        put(pixels(x, y), inside, Bytes(1));
});
