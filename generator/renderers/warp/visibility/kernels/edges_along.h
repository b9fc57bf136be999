#include "scene/kernels/simd.h"

const auto* hits = images.hits.data;
auto is_edge = [&](int i, int j) {
    if (hits[i][0] != hits[j][0])
        return true;
    const auto &m = images.normals.data[i], &n = images.normals.data[j];
    const float a = images.z_m.data[i], b = images.z_m.data[j], near = least(a, b);
    const float apart = a > b ? a - b : b - a;
    // Self-occlusion: depths that a continuous surface would not have. Floors seen at more than
    // two degrees change less between rows (640 x 480, 60 degrees).
    return m[0] * n[0] + m[1] * n[1] + m[2] * n[2] < crease_cosine || apart > 0.05f * near;
};
int edges = 0;
for (int k = 0; k < n; k += LANES) {
    unsigned faces = 0;
    if (n - k >= LANES)
        faces = bits(load(hits + i + k, Longs()) != load(hits + i + k + step, Longs()));
    else
        for (int m = k; m < n; ++m)
            faces |= (unsigned)!(hits[i + m] == hits[i + m + step]) << (m - k);
    // Most neighbours show the same face.
    for (; faces; faces &= faces - 1) {
        const int m = k + first_bit(faces);
        edges |= (int)is_edge(i + m, i + m + step) << m;
    }
}
return edges;
