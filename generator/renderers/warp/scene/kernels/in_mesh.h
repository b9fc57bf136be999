// Find a face of one mesh, any or the first: ``body`` is 0, and ``strike`` the intersection.

Ray ray;
start(ray, o, d);
Walk walk;
walk.top = 0;
Strike strike = {reach, 0.0f, 0.0f, -1};
const int body = search(walk, tree.data, ray, strike, ANY) ? 0 : -1;
