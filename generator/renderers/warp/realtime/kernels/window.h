// Windows of lattice points around (x, y). Needs ``lattice``, ``eye_m``, ``tolerance`` and UNSEEN.
#include "scene/kernels/simd.h"

const int points = values.shape[1];
auto is_inside = [&](int x, int y) {
    return x >= 0 && x < lattice.width && y >= 0 && y < lattice.height;
};
auto are_inside = [&](int x, int y) {
    return is_inside(x, y) && x + LANES <= lattice.width;
};
// Neighbours in a row; points off the lattice lie on no surface.
struct Points { Ints surface; Floats p[3], n[3]; };
auto points_at = [&](int x, int y) {
    const int first = y * lattice.width + x;
    Points points;
    if (are_inside(x, y)) {
        points.surface = load(lattice.surface.data + first, Ints());
        load_triples((const float*)(lattice.p_m.data + first), points.p);
        load_triples((const float*)(lattice.normal.data + first), points.n);
    } else {
        int surface[LANES];
        wp::vec3 p[LANES], n[LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const bool inside = is_inside(x + lane, y);
            surface[lane] = inside ? lattice.surface.data[first + lane] : -1;
            p[lane] = lattice.p_m.data[inside ? first + lane : 0];
            n[lane] = lattice.normal.data[inside ? first + lane : 0];
        }
        points.surface = load(surface, Ints());
        load_triples((const float*)p, points.p);
        load_triples((const float*)n, points.n);
    }
    return points;
};
auto values_at = [&](const float* from, int x, int y) {
    const int first = y * lattice.width + x;
    if (are_inside(x, y))
        return load(from + first, Floats());
    float values[LANES];
    for (int lane = 0; lane < LANES; ++lane)
        values[lane] = is_inside(x + lane, y) ? from[first + lane] : UNSEEN;
    return load(values, Floats());
};
auto write = [&](float* to, Floats lanes) {
    for (int lane = 0; lane < LANES && x + lane < lattice.width; ++lane)
        to[y * lattice.width + x + lane] = at(lanes, lane);
};
auto dot = [](const Floats* a, const Floats* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
};
const Floats zero = 0.0f;
const Points here = points_at(x, y);
const Floats away[3] = {here.p[0] - eye_m[0], here.p[1] - eye_m[1], here.p[2] - eye_m[2]};
const Floats squared_tolerance = dot(away, away) * (tolerance * tolerance);
// A term where points lie on one smooth stretch of surface, as lattice.points_agree; else 0.
auto where_one = [&](const Points& there, Floats term) -> Floats {
    const Floats way[3] = {there.p[0] - here.p[0], there.p[1] - here.p[1],
                          there.p[2] - here.p[2]};
    const Floats height = dot(here.n, way), least = 0.9f;
    const auto one = (here.surface == there.surface) & (dot(here.n, there.n) >= least)
                     & (height * height <= squared_tolerance);
    return one ? term : zero;
};
// Points at the rims of windows count half: windows are thus centred and contain every part of
// a 4 x 4 pattern equally often.
auto rim_weight = [](int offset, int half) -> Floats {
    return offset == half || offset == -half ? 0.5f : 1.0f;
};
