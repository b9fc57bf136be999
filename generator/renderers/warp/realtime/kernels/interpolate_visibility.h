// Inverse fourth powers of the distance in cells: the nearest point dominates, without a seam
// where it changes.
auto weight_at = [](float dx, float dy) {
    const float squared = dx * dx + dy * dy;
    return 1.0f / (0.05f + squared * squared);
};
// Points on the same body, near the pixel and similarly oriented: within 37 degrees, neighbours
// on round surfaces pass, pairs across an edge of a box do not. Visibility varies less than
// appearance: they need not share the pixel's material.
auto is_usable = [&](int q) {
    return lattice.body.data[q] == body && wp::dot(n, lattice.normal.data[q]) > 0.8f
           && wp::abs(wp::dot(n, lattice.p_m.data[q] - p)) < tolerance_m;
};
int points[16], count = 0;
float weights[16], whole = 0.0f;
// First the cell's corners; the ring around them only if none of the four is usable.
for (int reach = 0; reach < 2 && count == 0; ++reach) {
    for (int v = row - reach; v < row + 2 + reach; ++v) {
        for (int u = column - reach; u < column + 2 + reach; ++u) {
            if (v < 0 || v >= lattice.height || u < 0 || u >= lattice.width)
                continue;
            const int q = v * lattice.width + u;
            if (is_usable(q)) {
                const float weight = weight_at((float)(column - u) + right,
                                               (float)(row - v) + down);
                points[count] = q;
                weights[count++] = weight;
                whole += weight;
            }
        }
    }
}
if (count == 0)
    return false;
auto mean = [&](const float* values) {
    float sum = 0.0f;
    for (int k = 0; k < count; ++k) {
        // UNSEEN is negative and counts as dark.
        const float value = values[points[k]];
        sum += (value > 0.0f ? value : 0.0f) * weights[k];
    }
    return sum / whole;
};
const int length = listed.lit.shape[1], size = lit.shape[1];
for (int j = 0; j < lamps; ++j)
    listed.lit.data[j * length + k] = mean(lit.data + j * size);
listed.open_sky.data[k] = mean(open_sky.data);
listed.exposed.data[k] = covered ? mean(exposed.data) : 1.0f;
return true;
