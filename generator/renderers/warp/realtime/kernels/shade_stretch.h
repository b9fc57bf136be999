#include "scene/kernels/sample_quad.h"
#include "atmosphere/kernels/coat_quad.h"

// Light one step further along a line of two points.
auto continued = [](const wp::vec3& near, const wp::vec3& far) {
    wp::vec3 light;
    for (int c = 0; c < 3; ++c) {
        const float next = 2.0f * near[c] - far[c], low = CONTINUED_MIN * near[c];
        light[c] = next < low ? low : next > near[c] ? near[c] : next;
    }
    return light;
};
const int x1 = x0 + stride < view.width ? x0 + stride : view.width;
const int y1 = y0 + stride < view.height ? y0 + stride : view.height;
int mine = 0;
for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
        if (images.hits.data[y * view.width + x] == stretch.face)
            mine |= 1 << (4 * (y - y0) + x - x0);

const int corners[4] = {
    stretch.first, stretch.first + 1,
    stretch.first + stretch.columns, stretch.first + stretch.columns + 1};
int sources[4], counted = stretch.agrees;
wp::vec3 lit_at[4], rest_at[4];
for (int k = 0; k < 4; ++k) {
    sources[k] = corners[k];
    const int far = stretch.beyond[k];
    if (far >= 0) {
        counted |= 1 << k;
        sources[k] = corners[stretch.agrees >> (k ^ 2) & 1 ? k ^ 2 : k ^ 1];
    }
    const auto& near = lights.data[sources[k]];
    lit_at[k] = near.diffuse;
    rest_at[k] = near.rest;
    if (far >= 0) {
        lit_at[k] = continued(near.diffuse, lights.data[far].diffuse);
        rest_at[k] = continued(near.rest, lights.data[far].rest);
    }
}
const bool textured = stretch.texture >= 0, bumpy = stretch.bumpy != 0;
int missed = 0;
for (int rest = mine; rest;) {
    // Lanes to spare repeat the last pixel.
    int bits[QUAD], at[QUAD];
    Floats across, down;
    for (int k = 0; k < QUAD; ++k) {
        bits[k] = rest ? lowest_bit(rest) : bits[k - 1];
        rest &= rest - 1;
        at[k] = (y0 + (bits[k] >> 2)) * view.width + x0 + (bits[k] & 3);
        put(across, k, (float)(bits[k] & 3));
        put(down, k, (float)(bits[k] >> 2));
    }

    // Bilinear weights of the corners.
    const Floats right = across * step_x, lower = down * step_y;
    Floats weights[4], total = 0.0f, turned = 0.0f;
    for (int k = 0; k < 4; ++k) {
        const Floats w = (k & 1 ? right : 1.0f - right) * (k & 2 ? lower : 1.0f - lower);
        weights[k] = counted >> k & 1 ? w : zero;
        total += weights[k];
        turned += stretch.turns >> k & 1 ? w : zero;
    }
    const Floats inverse_total = 1.0f / larger(total, 1.0e-6f);
    for (int k = 0; k < 4; ++k)
        weights[k] = weights[k] * inverse_total;

    Coat coat;
    if (covered) {
        Floats mixable[4] = {zero, zero, zero, zero};
        for (int k = 0; k < 4; ++k)
            for (int c = 0; c < 4; ++c)
                mixable[c] += weights[k] * coats.data[sources[k]][c];
        coat = coat_of(mixable);
    }

    Floats color[3], diffuse = 1.0f, shine = 1.0f;
    for (int c = 0; c < 3; ++c)
        color[c] = stretch.albedo[c];
    if (textured) {
        Floats z, d[3], n[3] = {zero, zero, zero};
        for (int k = 0; k < QUAD; ++k)
            put(z, k, images.z_m.data[at[k]]);
        if (bumpy || patch.triplanar) {
            for (int k = 0; k < QUAD; ++k)
                for (int c = 0; c < 3; ++c)
                    put(n[c], k, images.normals.data[at[k]][c]);
        }
        if (view.lens == 0) {
            d[0] = (across + ((float)x0 + 0.5f - view.cx)) * view.inverse_fx;
            d[1] = (down + ((float)y0 + 0.5f - view.cy)) * view.inverse_fy;
            d[2] = one;
        } else {
            for (int k = 0; k < QUAD; ++k)
                for (int c = 0; c < 3; ++c)
                    put(d[c], k, view.directions.data[at[k]][c]);
        }
        Floats coordinates[3], shares[3] = {zero, zero, one};
        for (int k = 0; k < 3; ++k) {
            const auto& g = patch.gradients.data[k];
            coordinates[k] = patch.start[k] + (d[0] * g[0] + d[1] * g[1] + d[2] * g[2]) * z;
        }
        if (patch.triplanar) {
            // Eighth powers: projections blend in a narrow band only.
            Floats sum = 0.0f;
            for (int k = 0; k < 3; ++k) {
                const auto& m = patch.axes.data;
                Floats w = n[0] * m[0][k] + n[1] * m[1][k] + n[2] * m[2][k];
                w = w * w;
                w = w * w;
                shares[k] = w * w;
                sum += shares[k];
            }
            for (int k = 0; k < 3; ++k)
                shares[k] = shares[k] / sum;
        }
        Floats albedo[3] = {zero, zero, zero}, rough = 0.0f, m[3] = {zero, zero, zero};
        for (int axis = patch.triplanar ? 0 : 2; axis < 3; ++axis) {
            // A weight below one step of 8 bits is not worth a texture lookup.
            const Floats share = shares[axis] > 0.004f ? shares[axis] : zero;
            if (!any(share > zero))
                continue;
            const int along_u = axis == 0 ? 1 : 0, along_v = axis == 2 ? 1 : 2;
            Sample s = sample(
                textures.data[stretch.texture], sampler, coordinates[along_u],
                coordinates[along_v], bumpy);
            for (int c = 0; c < 3; ++c)
                albedo[c] += s.albedo[c] * share;
            rough += s.roughness * share;
            if (!bumpy)
                continue;
            if (covered) {
                s.bump[0] = s.bump[0] * coat.bumps;
                s.bump[1] = s.bump[1] * coat.bumps;
                s.bump[2] = s.bump[2] * coat.bumps + (1.0f - coat.bumps);
            }
            // A texture tilts a normal by at most 84 degrees: no side of it may face away.
            const Floats height = larger(s.bump[2], 0.1f);
            for (int c = 0; c < 3; ++c) {
                const auto& axes = patch.axes.data[c];
                m[c] += share * (
                    s.bump[0] * axes[along_u] + s.bump[1] * axes[along_v] + n[c] * height);
            }
        }
        for (int c = 0; c < 3; ++c)
            color[c] = color[c] * albedo[c];
        if (bumpy) {
            auto dot = [](const Floats* u, const wp::vec3& v) {
                return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
            };
            const Floats length = larger(m[0] * m[0] + m[1] * m[1] + m[2] * m[2], 1.0e-30f);
            const Floats inverse = 1.0f / root(length);
            const Floats after = larger(dot(m, stretch.towards) * inverse, 0.0f);
            // The ratio of cosines diverges at grazing light.
            const Floats before = larger(dot(n, stretch.towards), 0.1f);
            const Floats m_h = dot(m, stretch.half) * inverse, n_h = dot(n, stretch.half);
            const Floats roughness = rough * stretch.roughness;
            const Floats alpha = roughness * roughness;
            const Floats narrow = 1.0f - alpha * alpha;
            // The ratio of two GGX densities is the square of this; alpha^2 cancels.
            const Floats lobe =
                (1.0f - n_h * n_h * narrow) / larger(1.0f - m_h * m_h * narrow, 1.0e-4f);
            // Bounded: several lamps have no one direction, and isolated bumps would sparkle.
            diffuse = 1.0f + (smaller(after / before, 3.0f) - 1.0f) * stretch.lamps;
            shine = 1.0f + (smaller(lobe * lobe, 8.0f) - 1.0f) * stretch.shine;
        }
    }

    Floats light[3];
    for (int c = 0; c < 3; ++c) {
        Floats lit = 0.0f, rest_light = 0.0f;
        for (int k = 0; k < 4; ++k) {
            lit += weights[k] * lit_at[k][c];
            rest_light += weights[k] * rest_at[k][c];
        }
        if (covered)
            color[c] = color[c] * coat.wet + coat.snow * white[c];
        light[c] = lit * diffuse * color[c] + rest_light * shine;
    }
    for (int k = 0; k < QUAD; ++k) {
        if (get(total, k) > 0.0f && !(get(turned, k) > 0.0f))
            radiance.data[at[k]] =
                wp::vec3(get(light[0], k), get(light[1], k), get(light[2], k));
        else
            missed |= 1 << bits[k];
    }
}
return mine | missed << 16;
