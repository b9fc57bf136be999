// Visit the groups of LANES pixels of a triangle's box. ``matter(x, y)`` gets a group's first pixel
// and returns the pixels that matter, before edges are evaluated. ``visit(x, y, inside, at)`` gets
// the pixels of these inside all edges, moved outwards by ``reach``; ``at(k)`` has the edge
// functions at the group's k-th pixel: integers below 2^51, which double precision holds and adds
// exactly. Needs ``edges``, and simd.h before it.

struct Values { double a, b, c; };
// Steps of a row of ``width`` at which an edge function may be positive, rounded outwards by
// less than ROUNDED pixels.
constexpr int ROUNDED = 3;
auto narrow = [](double value, double dx, double inverse, int width, int& first, int& end) {
    const double root = -value * inverse;
    if (dx > 0.0 && root > first)
        first = root < width ? (int)root : width;
    else if (dx < 0.0 && root < end - 2)
        end = root > 0.0 ? (int)root + 2 : 2;
    else if (dx == 0.0 && value < 0.0)
        end = 0;
};
auto scan = [&](Values reach, auto matter, auto visit) {
    const Values dx = {(double)edges.a.dx, (double)edges.b.dx, (double)edges.c.dx};
    const Values dy = {(double)edges.a.dy, (double)edges.b.dy, (double)edges.c.dy};
    Values row = {edges.a.value + reach.a, edges.b.value + reach.b, edges.c.value + reach.c};
    const Doubles lanes_a = doubles(lane) * dx.a, lanes_b = doubles(lane) * dx.b;
    const Doubles lanes_c = doubles(lane) * dx.c;
    const int x_first = edges.box.x_first, width = edges.box.x_last - x_first + 1;
    const bool is_wide = width > LANES;
    Values inverse = {};
    if (is_wide)
        inverse = {1.0 / dx.a, 1.0 / dx.b, 1.0 / dx.c};
    for (int y = edges.box.y_first; y <= edges.box.y_last; ++y) {
        int first = 0, end = width;
        if (is_wide) {
            narrow(row.a, dx.a, inverse.a, width, first, end);
            narrow(row.b, dx.b, inverse.b, width, first, end);
            narrow(row.c, dx.c, inverse.c, width, first, end);
        }
        for (int x = first; x < end; x += LANES) {
            unsigned inside = matter(x_first + x, y) & first_bits(width - x);
            if (!inside)
                continue;
            auto at = [&](int k) {
                const double step = x + k;
                return Values{row.a + step * dx.a, row.b + step * dx.b, row.c + step * dx.c};
            };
            if (!is_wide || x < first + ROUNDED || x + LANES > end - ROUNDED) {
                const Values e = at(0);
                const Doubles a = lanes_a + e.a, b = lanes_b + e.b, c = lanes_c + e.c;
                inside &= bits(least(a, least(b, c)) >= Doubles(0.0));
                if (!inside)
                    continue;
            }
            visit(x_first + x, y, inside, at);
        }
        row = {row.a + dy.a, row.b + dy.b, row.c + dy.c};
    }
};
