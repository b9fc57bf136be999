// Of candidates, one bit each, the points of an image at which a triangle has no hole; ``nearness``
// is 1/z [1/m]. Texels are read as by ``alpha_test.is_covered``. Needs ``world`` and ``cutout``, and
// simd.h before it.

auto solid = [&](unsigned candidates, auto x_px, auto y_px, auto nearness) {
    if (cutout.texture < 0)
        return candidates;
    typedef decltype(nearness) Points;
    const auto& texture = world.textures.data[cutout.texture];
    const int width = texture.width, height = texture.height;
    const Points z_m = Points(1.0f) / nearness;
    Points u = Points(cutout.u)
        + (Points(cutout.c_u) + x_px * cutout.dx_u + y_px * cutout.dy_u) * z_m;
    Points v = Points(cutout.v)
        + (Points(cutout.c_v) + x_px * cutout.dx_v + y_px * cutout.dy_v) * z_m;
    auto whole = [&](Points w) {
        const auto i = ints(w);
        return floats(i) > w ? i - 1 : i;
    };
    u = clamped(u, Points(-1.0e6f), Points(1.0e6f));
    v = clamped(v, Points(-1.0e6f), Points(1.0e6f));
    const Points x = (u - floats(whole(u))) * (float)width - 0.5f;
    const Points y = (1.0f - (v - floats(whole(v)))) * (float)height - 0.5f;
    const auto x0 = whole(x), y0 = whole(y);
    const Points right = x - floats(x0), down = y - floats(y0);
    const auto left = x0 < 0 ? width - 1 : x0, next = x0 + 1 >= width ? 0 : x0 + 1;
    const auto top = (y0 < 0 ? height - 1 : y0) * width;
    const auto below = (y0 + 1 >= height ? 0 : y0 + 1) * width;
    auto texels = [&](auto i) { return floats(gather(texture.cover.data, i)); };
    const Points upper = texels(top + left) * (1.0f - right) + texels(top + next) * right;
    const Points lower = texels(below + left) * (1.0f - right) + texels(below + next) * right;
    return candidates & bits(upper * (1.0f - down) + lower * down >= Points(127.5f));
};
