#include "scene/kernels/simd.h"

const int count = radiance.shape[0];
const float* share = shares.data + 8 * count * (first / 8) + first % 8;
const float* rgb = (const float*)radiance.data;
Floats red = 0.0f, green = 0.0f, blue = 0.0f;
for (int i = 0; i < count; ++i, share += 8, rgb += 3) {
    const Floats weight = load(share, Floats());
    red += weight * rgb[0];
    green += weight * rgb[1];
    blue += weight * rgb[2];
}
for (int lane = 0; lane < LANES; ++lane)
    means.data[first + lane] = wp::vec3(at(red, lane), at(green, lane), at(blue, lane));
