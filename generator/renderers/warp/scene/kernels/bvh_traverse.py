"""Ray traversal of bounding volume hierarchies, eight boxes or eight triangles at a time.

Trees are built by gen_data.renderers.warp.scene.bvh. On the CPU the traversal takes a
third of the time of ``wp.mesh_query_ray``, which tests boxes and triangles one by one. On CUDA a
thread tests the eight one after another, in the same order and with the same arithmetic: hits are
equal to the last bit.

Sources: Wald, Benthin and Boulos, "Getting rid of packets: efficient SIMD single-ray traversal
using multi-branching BVHs", 2008; Woop, Benthin and Wald, "Watertight ray/triangle intersection",
JCGT 2(1), 2013; Ize, "Robust BVH ray traversal", JCGT 2(2), 2013 (FARTHER).
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels.records import BodyRecord, Geometry

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

Found = wp.spatial_vectord
"""Intersection of a ray: parameter, weights of a face's first and second corner, face, body
(0 within a mesh), and an unused number; face and body are -1 for a miss."""


@wp.func_native(native("scene/kernels/first_in_mesh.h"))
def first_in_mesh(
    tree: wp.array[wp.float32], o: wp.vec3, d: wp.vec3, reach: float
) -> wp.spatial_vectord:
    """The first face along a ray in the mesh frame, before a parameter."""
    ...


@wp.func_native(native("scene/kernels/any_in_mesh.h"))
def any_in_mesh(tree: wp.array[wp.float32], o: wp.vec3, d: wp.vec3, reach: float) -> bool:
    """Whether a ray in the mesh frame meets a face before a parameter."""
    ...


@wp.func_native(native("scene/kernels/first_in_scene.h"))
def first_in_scene(
    tree: wp.array[wp.float32],
    bodies: wp.array[BodyRecord],
    geometries: wp.array[Geometry],
    o: wp.vec3,
    d: wp.vec3,
    reach: float,
    through: int,
) -> wp.spatial_vectord:
    """The first face along a ray, of all bodies without the cut-outs that ``through`` names."""
    ...


@wp.func_native(native("scene/kernels/any_in_scene.h"))
def any_in_scene(
    tree: wp.array[wp.float32],
    bodies: wp.array[BodyRecord],
    geometries: wp.array[Geometry],
    o: wp.vec3,
    d: wp.vec3,
    reach: float,
    through: int,
) -> int:
    """A body without the cut-outs that ``through`` names that a ray meets; -1 for none."""
    ...
