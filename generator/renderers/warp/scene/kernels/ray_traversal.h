#include "scene/kernels/simd.h"

// Parameter and code in one integer: positive floats compare like integers, nearest first.
typedef unsigned long long Entry;
// Ize 2013: 1 + twice the rounding error of a slab's parameter: no box is missed.
constexpr float FARTHER = 1.0000004f;

struct Ray {
    float o[3], d[3], inverse[3];
    int near[3];        // offsets of the planes through which it enters a box
    int kx, ky, kz;     // axes, the dominant one last
    float sx, sy, sz;   // shear that aligns the ray with that axis
};
struct Strike { float t, u, v; int face; };
// The same 32 bits.
union Word { float number; unsigned bits; };
auto to_bits = [](float x) { Word word; word.number = x; return word.bits; };
auto to_float = [](Entry bits) { Word word; word.bits = (unsigned)bits; return word.number; };
struct Walk { Entry stack[256]; int top; };

auto start = [](Ray& ray, const wp::vec3& o, const wp::vec3& d) {
    for (int k = 0; k < 3; ++k) {
        ray.o[k] = o[k];
        // A tiny number instead of zero: a finite reciprocal, and 0 * inf cannot arise.
        ray.d[k] = d[k] < 1.0e-20f && d[k] > -1.0e-20f ? 1.0e-20f : d[k];
        ray.inverse[k] = 1.0f / ray.d[k];
        ray.near[k] = 8 * (2 * k + (ray.d[k] < 0.0f));
    }
    const float x = ray.d[0] < 0.0f ? -ray.d[0] : ray.d[0];
    const float y = ray.d[1] < 0.0f ? -ray.d[1] : ray.d[1];
    const float z = ray.d[2] < 0.0f ? -ray.d[2] : ray.d[2];
    ray.kz = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
    ray.kx = ray.kz == 2 ? 0 : ray.kz + 1;
    ray.ky = ray.kx == 2 ? 0 : ray.kx + 1;
    ray.sz = ray.inverse[ray.kz];
    ray.sx = ray.d[ray.kx] * ray.sz;
    ray.sy = ray.d[ray.ky] * ray.sz;
};

// Slab test of a node's eight boxes: push the ones that the ray enters, the nearest on top.
auto enter = [&](Walk& walk, const Ray& ray, const float* node, float reach, bool sorted) {
    const int first = walk.top;
    for (int part = 0; part < 8; part += LANES) {
        auto slab = [&](int k, int lanes) {
            return (load(node + lanes + part, Floats()) - Floats(ray.o[k])) * ray.inverse[k];
        };
        const Floats enters_x = slab(0, ray.near[0]), leaves_x = slab(0, ray.near[0] ^ 8);
        const Floats enters_y = slab(1, ray.near[1]), leaves_y = slab(1, ray.near[1] ^ 8);
        const Floats enters_z = slab(2, ray.near[2]), leaves_z = slab(2, ray.near[2] ^ 8);
        const Floats enters = larger(enters_x, larger(enters_y, larger(enters_z, 0.0f)));
        const Floats leaves = smaller(smaller(leaves_x, leaves_y), leaves_z);
        unsigned hits = bits(enters <= smaller(leaves * FARTHER, reach));
        const int* codes = (const int*)(node + 48) + part;
        while (hits) {
            const int lane = first_bit(hits);
            hits &= hits - 1;
            const Entry entry = (Entry)to_bits(at(enters, lane)) << 32 | (unsigned)codes[lane];
            // Insertion sort: a ray enters few of the eight boxes.
            int place = walk.top++;
            for (; sorted && place > first && walk.stack[place - 1] < entry; --place)
                walk.stack[place] = walk.stack[place - 1];
            walk.stack[place] = entry;
        }
    }
};

// Pop the next code that begins within reach, down to a floor; false if there is none.
auto next = [&](Walk& walk, int floor, float reach, int& code) {
    while (walk.top > floor) {
        const Entry entry = walk.stack[--walk.top];
        code = (int)(unsigned)entry;
        if (to_float(entry >> 32) < reach)
            return true;
    }
    return false;
};

// Watertight test of eight triangles (Woop et al. 2013): whether any hit is nearer than before.
auto meet = [&](const float* leaf, const Ray& ray, Strike& strike) {
    const Floats ox = ray.o[ray.kx], oy = ray.o[ray.ky], oz = ray.o[ray.kz], zero = 0.0f;
    bool any = false;
    for (int part = 0; part < 8; part += LANES) {
        const float* faces = leaf + part;
        auto corner = [&](int axis, int k) {
            return load(faces + 24 * axis + 8 * k, Floats());
        };
        const Floats az = corner(ray.kz, 0) - oz;
        const Floats bz = corner(ray.kz, 1) - oz;
        const Floats cz = corner(ray.kz, 2) - oz;
        const Floats ax = corner(ray.kx, 0) - ox - az * ray.sx;
        const Floats bx = corner(ray.kx, 1) - ox - bz * ray.sx;
        const Floats cx = corner(ray.kx, 2) - ox - cz * ray.sx;
        const Floats ay = corner(ray.ky, 0) - oy - az * ray.sy;
        const Floats by = corner(ray.ky, 1) - oy - bz * ray.sy;
        const Floats cy = corner(ray.ky, 2) - oy - cz * ray.sy;
        // Scaled barycentric weights: edge functions in the sheared plane.
        const Floats u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
        const Floats low = smaller(smaller(u, v), w), high = larger(larger(u, v), w);
        const Floats sum = u + v + w;
        const Floats t = (u * az + v * bz + w * cz) * ray.sz / sum;
        const Floats reach = strike.t;
        // All weights of one sign: faces have two sides, and shared edges leave no gap.
        const auto inside = (low >= zero) | (high <= zero);
        unsigned hits = bits(inside & (t >= zero) & (t < reach));
        any |= hits != 0;
        while (hits) {
            const int lane = first_bit(hits);
            hits &= hits - 1;
            // In lane order: equal distances keep the first face, whatever the processor.
            if (at(t, lane) < strike.t) {
                strike.t = at(t, lane);
                strike.u = at(u, lane) / at(sum, lane);
                strike.v = at(v, lane) / at(sum, lane);
                strike.face = ((const int*)(faces + 72))[lane];
            }
        }
    }
    return any;
};

// Traverse a mesh: whether any face is nearer than before.
auto search = [&](Walk& walk, const float* tree, const Ray& ray, Strike& strike, bool any) {
    const int floor = walk.top;
    int code = *(const int*)tree;
    bool met = false;
    do {
        if (code >= 0)
            enter(walk, ray, tree + 8 * code, strike.t, !any);
        else
            met |= meet(tree - 8 * code, ray, strike);
    } while (!(any && met) && next(walk, floor, strike.t, code));
    walk.top = floor;
    return met;
};
