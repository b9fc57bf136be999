"""Projection of points into the image, for every lens model.

The equations and their sources are in gen_data.core.lens; here in single precision.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

NEAR_M = wp.constant(0.05)


@wp.func
def distort(view: records.View, q: wp.vec3):
    """Undistorted plane coordinates of a camera-frame point, distorted by the lens model."""
    k = view.coefficients
    across = wp.sqrt(q[0] * q[0] + q[1] * q[1])
    place = wp.vec2(0.0, 0.0)
    if view.lens == records.EQUIRECTANGULAR:
        place = wp.vec2(wp.atan2(q[0], q[2]), wp.atan2(q[1], wp.sqrt(q[0] * q[0] + q[2] * q[2])))
    elif view.lens == records.KANNALA_BRANDT and across > 0.0:
        # Kannala and Brandt 2006: an odd polynomial of the angle to the axis.
        a = wp.atan2(across, q[2])
        s = a * a
        radius = a * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))))
        place = wp.vec2(q[0], q[1]) * (radius / across)
    elif view.lens == records.BROWN_CONRADY and q[2] > NEAR_M:
        x = q[0] / q[2]
        y = q[1] / q[2]
        s = x * x + y * y
        # Brown-Conrady with OpenCV's rational radial factor and tangential terms.
        radial = 1.0 + s * (k[0] + s * (k[1] + s * k[4]))
        radial /= 1.0 + s * (k[5] + s * (k[6] + s * k[7]))
        u = x * radial + 2.0 * k[2] * x * y + k[3] * (s + 2.0 * x * x)
        v = y * radial + k[2] * (s + 2.0 * y * y) + 2.0 * k[3] * x * y
        place = wp.vec2(u, v)
    return place


@wp.func
def project_to_pixel(view: records.View, q: wp.vec3):
    """The pixel that shows a camera-frame point, -1 for none, and the point's depth."""
    j = int(-1)
    depth_m = q[2]
    x = int(-1)
    y = int(-1)
    if view.lens != records.PINHOLE:
        depth_m = wp.length(q)
        place = distort(view, q)
        x = int(wp.floor(place[0] * view.fx + view.cx))
        y = int(wp.floor(place[1] * view.fy + view.cy))
    elif q[2] > NEAR_M:
        x = int(q[0] / q[2] * view.fx + view.cx)
        y = int(q[1] / q[2] * view.fy + view.cy)
    if x >= 0 and x < view.width and y >= 0 and y < view.height:
        j = y * view.width + x
    if j >= 0 and view.lens != records.PINHOLE:
        # Beyond the model's validity the polynomial folds back: check that the pixel does look
        # there.
        d = view.directions[j]
        away = 2.0 * wp.max(d[3], view.pixel_rad)
        if wp.dot(records.fast_normalize(q), wp.vec3(d[0], d[1], d[2])) < 1.0 - 0.5 * away * away:
            j = -1
    return j, depth_m


@wp.kernel
def darken_outside(view: records.View, radiance: wp.array[wp.vec3]):
    """Set radiance to zero where the lens shows nothing."""
    i = wp.tid()
    if view.directions[i][3] == 0.0:
        radiance[i] = wp.vec3(0.0)
