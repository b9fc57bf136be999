"""Construction of eight-wide bounding volume hierarchies by the surface area heuristic.

Source: Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE RT 2007, with
nodes of eight as in Wald, Benthin and Boulos 2008: the largest part of a node is split until there
are eight. Trees over sorted boxes: Lauterbach et al., "Fast BVH construction on GPUs", Computer
Graphics Forum 28(2), 2009.
"""

import warp as wp

from gen_data.renderers.warp.native_code import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Bounds of an empty lane, which no ray enters.
NOWHERE = 1.0e30


@wp.func_native(native("scene/kernels/grow.h", NOWHERE=NOWHERE))
def grow(
    boxes: wp.array2d[wp.float32],
    leaf: int,
    cells: wp.array[wp.uint32],
    nodes: wp.array3d[wp.float32],
    codes: wp.array2d[wp.int32],
    leaves: wp.array[wp.vec2i],
    counts: wp.array[wp.int32],
):
    """Build one tree; arguments as for ``grow_tree``."""
    ...


@wp.kernel
def grow_tree(
    boxes: wp.array2d[float],
    leaf: int,
    cells: wp.array[wp.uint32],
    nodes: wp.array3d[float],
    codes: wp.array2d[int],
    leaves: wp.array[wp.vec2i],
    counts: wp.array[int],
):
    """Build one tree; launched with a single thread, on the CPU.

    Args:
        boxes: Low corner, number, minus high corner, 0 [n, 8]; permuted: the boxes of a
            node are contiguous.
        leaf: Maximum number of boxes in a leaf.
        cells: Morton codes of the boxes' cells [n], rising: parts are cut between cells; none to
            cut parts by the surface area heuristic.
        nodes: Bounds: low x, high x, low y, ... [., 6, 8]; no ray enters unused lanes.
        codes: Child of each lane: the number of a node, or -1 - number of a leaf [., 8].
        leaves: (begin, end) into ``boxes``.
        counts: (nodes, leaves).
    """
    grow(boxes, leaf, cells, nodes, codes, leaves, counts)


@wp.kernel
def fill_leaves(
    boxes: wp.array2d[float],
    leaves: wp.array[wp.vec2i],
    vertices_m: wp.array[wp.vec3],
    faces: wp.array2d[int],
    corners_m: wp.array3d[float],
    numbers: wp.array3d[int],
):
    """Copy the triangles of a mesh into the leaves of its tree; a thread per leaf, on the CPU.

    Args:
        boxes: As ``grow_tree`` leaves them.
        leaves: As ``grow_tree`` leaves them.
        vertices_m: Vertices of the mesh.
        faces: Faces of the mesh [n, 3].
        corners_m: Groups of leaves [., 10, 8]: x of first, second and third corners, y, z; 0 in
            lanes without a face.
        numbers: The same memory as integers; the last group of each leaf is filled with the numbers
            of faces, -1 in lanes without one.
    """
    leaf = wp.tid()
    first = leaves[leaf][0]
    count = leaves[leaf][1] - first
    for lane in range(8):
        numbers[leaf, 9, lane] = -1
        if lane < count:
            face = int(boxes[first + lane, 3])
            numbers[leaf, 9, lane] = face
            for k in range(3):
                corner = vertices_m[faces[face, k]]
                for axis in range(3):
                    corners_m[leaf, 3 * axis + k, lane] = corner[axis]
