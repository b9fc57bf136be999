"""Bounding volume hierarchies of eight-wide nodes, in the layout that kernels.bvh_traverse reads.

A tree is one array of floats, in groups of eight; integers are stored by their bits.

- Group 0: the root's code. A code is the index of a node's first group; or minus that of a leaf;
  or, in trees over bodies, whose leaves are bodies, -1 - body.
- A node has seven groups of eight lanes: low x, high x, low y, high y, low z, high z, codes.
- A leaf of a mesh has ten groups: x of its faces' first, second and third corners, then y and z
  likewise; and the numbers of the faces.
"""

from functools import cache
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.renderers.warp.scene.kernels import box_groups, bvh_build

_WIDTH = 8
_NODE_GROUPS, _LEAF_GROUPS = 7, 10

_SCALARS = (wp.int32, wp.uint32, wp.float32)

Floats = NDArray[np.float32]
Ints = NDArray[np.int32]


def face_boxes(vertices_m: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Low and high corners [n, 3] of the faces' bounding boxes."""
    # Corner by corner: a reduction over the short middle axis of [n, 3, 3] takes ten times as long.
    a, b, c = (vertices_m.take(faces[:, k], axis=0) for k in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def mesh_tree(
    vertices_m: Floats, faces: Ints, lows_m: Floats, highs_m: Floats, *, quick: bool = False
) -> Floats:
    """Tree over a mesh's faces, given their boxes; missing triangles of a leaf are points.

    A ``quick`` one is made in a fraction of the time, for meshes of a single scene; its boxes
    overlap more.
    """
    boxes, nodes, codes, leaves = _grow(lows_m, highs_m, _WIDTH, quick=quick)
    leaf_groups = np.zeros((len(leaves), _LEAF_GROUPS, _WIDTH), np.float32)
    if len(leaves):
        corners = np.ascontiguousarray(vertices_m, np.float32)
        indices = np.ascontiguousarray(faces, np.int32)
        given = [_wrap(boxes, wp.float32), _wrap(leaves, wp.vec2i), _wrap(corners, wp.vec3)]
        given.append(_wrap(indices, wp.int32))
        filled = [_wrap(leaf_groups, wp.float32), _wrap(leaf_groups, wp.int32)]
        wp.launch(bvh_build.fill_leaves, len(leaves), given, filled, device="cpu")
    first_leaf = 1 + _NODE_GROUPS * len(nodes)
    return _pack(nodes, codes, first_leaf + _LEAF_GROUPS * np.arange(len(leaves)), leaf_groups)


def body_tree(lows_m: Floats, highs_m: Floats) -> Floats:
    """Tree over the bodies' boxes."""
    boxes, nodes, codes, leaves = _grow(lows_m, highs_m, 1, quick=False)
    order = boxes[:, 3].astype(np.int32)
    return _pack(nodes, codes, 1 + order[leaves[:, 0]], np.zeros((0, 1, _WIDTH), np.float32))


def group_boxes(lows: Floats, highs: Floats) -> Floats:
    """Boxes in the layout that ``kernels.box_groups`` reads, flat."""
    groups = np.full((-(-len(lows) // _WIDTH), _WIDTH, 3, 2), box_groups.NOWHERE_M, np.float32)
    flat = groups.reshape(-1, 3, 2)
    flat[: len(lows), :, 0], flat[: len(highs), :, 1] = lows, highs
    return np.asarray(groups.transpose(0, 2, 3, 1).reshape(-1))


def _pack(nodes: Floats, codes: Ints, leaf_places: NDArray[np.integer], tail: Floats) -> Floats:
    if len(leaf_places):
        leaf_codes = -leaf_places[np.maximum(-1 - codes, 0)]
        codes = np.where(codes < 0, leaf_codes, 1 + _NODE_GROUPS * codes).astype(np.int32)
    head = np.zeros((1, _WIDTH), np.int32)
    # Every tree but a single leaf begins with node 0.
    head[0, 0] = 1 if len(nodes) else -leaf_places[0]
    inner = np.concatenate([nodes, codes[:, None].view(np.float32)], axis=1)
    groups = [head.view(np.float32), *(part.reshape(-1, _WIDTH) for part in (inner, tail))]
    return np.concatenate(groups).reshape(-1)


def _grow(
    lows: Floats, highs: Floats, leaf: int, *, quick: bool
) -> tuple[Floats, Floats, Ints, Ints]:
    """Build a tree; returns the boxes in its order and the outputs of ``bvh_build.grow_tree``."""
    n = len(lows)
    # Each node splits a range: there are fewer nodes than boxes.
    nodes = np.zeros((max(n, 1), 6, _WIDTH), np.float32)
    codes = np.zeros((max(n, 1), _WIDTH), np.int32)
    leaves = np.zeros((n, 2), np.int32)
    counts = np.zeros(2, np.int32)
    boxes = np.zeros((n, 8), np.float32)
    if n == 0:
        nodes[:, ::2], nodes[:, 1::2] = bvh_build.NOWHERE, -bvh_build.NOWHERE
        return boxes, nodes, codes, leaves
    boxes[:, :3], boxes[:, 4:7] = lows, -highs
    # Numbers up to 2**24 are exact.
    boxes[:, 3] = np.arange(n)
    cells = np.zeros(0, np.uint32)
    if quick:
        cells, order = _morton_order(lows, highs)
        boxes = boxes.take(order, axis=0)
    outputs = [_wrap(nodes, wp.float32), _wrap(codes, wp.int32), _wrap(leaves, wp.vec2i)]
    outputs.append(_wrap(counts, wp.int32))
    given = [_wrap(boxes, wp.float32), leaf, _wrap(cells, wp.uint32)]
    wp.launch(bvh_build.grow_tree, 1, given, outputs, device="cpu")
    return boxes, nodes[: counts[0]], codes[: counts[0]], leaves[: counts[1]]


def _morton_order(lows: Floats, highs: Floats) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Codes [n] of the cells of boxes' centres, rising, and the numbers [n] of these boxes.

    Cells are cubes: 1,024 along the longest side.
    """
    # Column by column: numpy is slow on the short axis of [n, 3].
    centres = [low + high for low, high in zip(lows.T, highs.T, strict=True)]
    starts = [float(centre.min()) for centre in centres]
    widest = max(float(c.max()) - start for c, start in zip(centres, starts, strict=True))
    scale = np.float32(1023.0 / max(widest, 1e-30))
    code = np.zeros(len(lows), np.uint32)
    for axis, (centre, start) in enumerate(zip(centres, starts, strict=True)):
        cell = np.minimum((centre - np.float32(start)) * scale, np.float32(1023.0))
        code |= _spread_bits()[axis].take(cell.astype(np.int32))
    # NumPy sorts numbers of 16 bits ten times as fast.
    order = np.argsort(code.astype(np.uint16), kind="stable")
    high = (code >> 16).astype(np.uint16).take(order)
    order = order.take(np.argsort(high, kind="stable"))
    return code.take(order), order


@cache
def _spread_bits() -> NDArray[np.uint32]:
    """Numbers below 1,024 with two zeros between their bits, moved by 0, 1 and 2 bits [3, 1024]."""
    numbers = np.arange(1024)
    spread = sum(((numbers >> k) & 1) << (3 * k) for k in range(10))
    return np.stack([spread << axis for axis in range(3)]).astype(np.uint32)


def _wrap(values: NDArray[np.generic], dtype: Any) -> wp.array:
    """Wrap a host array for kernels on the CPU without a copy; it must outlive them."""
    shape = values.shape if dtype in _SCALARS else values.shape[:-1]
    return wp.array(ptr=values.ctypes.data, dtype=dtype, shape=shape, device="cpu")
