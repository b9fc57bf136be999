"""Triangles of the shapes of a description, with its materials."""

import math
from dataclasses import replace

import numpy as np

from gen_data.assets import asset_folder, texture_maps, triangle_soup
from gen_data.assets.readers import mesh_source, read_mesh
from gen_data.assets.robot_description import Look, Shape
from gen_data.core.errors import AssetError, did_you_mean
from gen_data.core.se3 import SE3


def read_shape(
    folder: asset_folder.Folder, shape: Shape, T_root_link: SE3, *, materials: bool = True
) -> mesh_source.MeshSource:
    """Read or make the triangles of a shape, in the root frame and its colour.

    The name of an image inside a mesh file is preceded by the name of the file.

    Raises:
        AssetError: if its mesh is unusable.
    """
    matrix = (T_root_link @ shape.T_link_shape).matrix()[:3]
    if shape.kind == "mesh":
        own = materials and not shape.look.whole
        whole = read_mesh(folder, shape.file, materials=own)
        if shape.part:
            whole = replace(whole, soup=_part_of(whole.soup, shape, folder))
        source = _with_named_images(whole, shape.file)
        matrix[:, :3] = matrix[:, :3] * np.array(shape.size)
        if shape.file.lower().endswith((".glb", ".gltf")):
            # Y points up in glTF: RViz (ros2/rviz pull request 1482) and Drake turn it, too.
            matrix = matrix[:, [0, 2, 1, 3]] * (1.0, 1.0, -1.0, 1.0)
    else:
        source = mesh_source.MeshSource(triangle_soup.TriangleSoup.of(_primitive(shape)))
        if shape.look.texture and materials:
            uvs = _wrapped(shape.kind, source.soup.corners)
            source = replace(source, soup=replace(source.soup, uvs=uvs))
    soup = source.soup
    extent = float(np.ptp(soup.corners.reshape(-1, 3), axis=0).max()) if soup.uvs is None else 0.0
    slots = tuple(_apply_look(slot, shape.look, extent) for slot in soup.slots)
    colors = _uncovered_colors(soup, slots)
    return replace(source, soup=replace(soup, slots=slots, colors=colors).transformed(matrix))


def _uncovered_colors(
    soup: triangle_soup.TriangleSoup, slots: tuple[triangle_soup.MaterialSlot, ...]
) -> triangle_soup.Float64 | None:
    """Vertex colours of a mesh, white where a description gives it another colour or an image."""
    if soup.colors is None:
        return None
    covered = [
        (old.material.base_color, old.material.texture)
        != (new.material.base_color, new.material.texture)
        for old, new in zip(soup.slots, slots, strict=True)
    ]
    colors: triangle_soup.Float64 = np.where(
        np.array(covered)[soup.face_slots][:, None, None], 1.0, soup.colors
    )
    return colors


def _part_of(
    soup: triangle_soup.TriangleSoup, shape: Shape, folder: asset_folder.Folder
) -> triangle_soup.TriangleSoup:
    """The triangles of the named object of a mesh file.

    Raises:
        AssetError: if it has none of that name.
    """
    numbers = [k for k, name in enumerate(soup.group_names) if name == shape.part]
    part = soup.select(np.isin(soup.face_groups, numbers))
    if not len(part):
        known = f"{did_you_mean(shape.part, soup.group_names)}; correct the name"
        raise AssetError(f"{folder.root / shape.file}: has no part '{shape.part[:60]}'{known}")
    if shape.centered:
        points = part.corners.reshape(-1, 3)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        part = replace(part, corners=part.corners - middle)
    return part


def _with_named_images(source: mesh_source.MeshSource, file: str) -> mesh_source.MeshSource:
    """The source with unique names of its images: a link may have several mesh files."""
    if not source.images:
        return source
    known = {name: f"{file}/{name}" for name in source.images}

    def renamed(texture: str) -> str:
        maps = texture_maps.find_maps(texture)
        if maps is None:
            return known.get(texture, texture)
        return maps.renamed(known).name()

    slots = tuple(
        replace(slot, material=replace(slot.material, texture=renamed(slot.material.texture)))
        for slot in source.soup.slots
    )
    images = {known[name]: data for name, data in source.images.items()}
    return replace(source, soup=replace(source.soup, slots=slots), images=images)


def _primitive(shape: Shape) -> triangle_soup.Float64:
    if shape.kind == "box":
        return triangle_soup.box(shape.size)
    if shape.kind == "cylinder":
        return triangle_soup.cylinder(shape.size[0], shape.size[1])
    if shape.kind == "capsule":
        return triangle_soup.capsule(shape.size[0], shape.size[1])
    if shape.kind == "ellipsoid":
        stretched: triangle_soup.Float64 = triangle_soup.sphere(1.0) * np.array(shape.size)
        return stretched
    return triangle_soup.sphere(shape.size[0])


def _apply_look(
    slot: triangle_soup.MaterialSlot, look: Look, extent_m: float
) -> triangle_soup.MaterialSlot:
    """Apply the material of a description to a slot without texture.

    White is the usual placeholder in descriptions; it does not replace the mesh's own colours.
    Where there are no texture coordinates, the image is projected from three sides, once over the
    ``extent_m``.
    """
    changes: dict[str, object] = {}
    if look.opacity < 1.0:
        changes["opacity"] = look.opacity
    for name in ("roughness", "metallic"):
        if getattr(look, name) is not None:
            changes[name] = getattr(look, name)
    placeholder = slot.from_file and look.color is not None and min(look.color) > 0.99
    replaced = not slot.material.texture and not placeholder
    if look.texture and not slot.material.texture:
        changes |= {"texture": look.texture, "base_color": (1.0, 1.0, 1.0)}
        changes["texture_scale_m"] = round(extent_m, 6)
    if look.color is not None and replaced:
        changes["base_color"] = mesh_source.srgb_to_linear(look.color)
    if not changes:
        return slot
    material = replace(slot.material, **changes)  # type: ignore[arg-type]
    named = look.name if (look.color is not None and replaced) or look.texture else ""
    return triangle_soup.MaterialSlot(named or slot.name, material, True)


def _wrapped(kind: str, corners: triangle_soup.Float64) -> triangle_soup.Float64:
    """Texture coordinates [m, 3, 2] of a primitive.

    The whole image is upright on each face of a box, and goes once around anything else.
    """
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    shares = (corners - low) / (high - low)
    if kind != "box":
        around = np.arctan2(corners[..., 1], corners[..., 0]) / (2.0 * math.pi)
        # Triangles across the seam continue beyond 1; at the poles any direction will do.
        first = around[:, :1]
        around = around + np.rint(first - around)
        return np.round(np.stack([around, shares[..., 2]], axis=-1), 6)
    normals = triangle_soup.face_crosses(corners)
    axis = np.abs(normals).argmax(axis=1)
    sign = np.sign(np.take_along_axis(normals, axis[:, None], axis=1))
    x, y, z = (shares[..., k] - 0.5 for k in range(3))
    right = np.where(axis[:, None] == 0, sign * y, sign * np.where(axis[:, None] == 1, -x, x))
    up = np.where(axis[:, None] == 2, y, z)
    return np.stack([right + 0.5, up + 0.5], axis=-1)
