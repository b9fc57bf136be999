// Find a ``body`` and its ``strike``, any or the first.

Ray ray, local;
start(ray, o, d);
Walk walk;
walk.top = 0;
Strike strike = {reach, 0.0f, 0.0f, -1};
int body = -1, code = *(const int*)tree.data;
do {
    if (code >= 0) {
        enter(walk, ray, tree.data + 8 * code, strike.t, !ANY);
        continue;
    }
    const auto& placed = bodies.data[-1 - code];
    if (placed.cutouts & through)
        continue;
    const wp::vec3 begin = mul(placed.B_mesh_world, o) + placed.t_mesh_world;
    start(local, begin, mul(placed.B_mesh_world, d));
    if (search(walk, geometries.data[placed.geometry].tree.data, local, strike, ANY))
        body = -1 - code;
} while (!(ANY && body >= 0) && next(walk, 0, strike.t, code));
