"""Builds the nominal Scene of a template's elements."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core import errors, plates, se3
from gen_data.core.interfaces import AssetIndex, Element
from gen_data.core.scene import Lane, Light, Region, Scene, SupportSurface
from gen_data.scene_templates.element import Element as TemplateElement

CONTENT_HEIGHT_M = 0.25
"""Height above a surface that belongs to the focus region."""

STREET_MARGIN_M, STREET_HEIGHT_M = 50.0, 60.0
"""Extents beyond the lanes of a street, to the sides and upwards."""

DEFAULT_LIGHT = Light("lamp", "sphere", (0.4, -0.9, 2.2), intensity_cd=900.0, radius_m=0.08)


def build_scene(name: str, elements: Sequence[Element], assets: AssetIndex) -> Scene:
    """Build the nominal scene of a template: every element at its nominal pose.

    Elements are added in their order, but groups of objects last: they have to keep clear of the
    other elements on their surfaces.

    Raises:
        ConfigError: a relation names an unknown or absent element, or is impossible.
        AssetError: an asset is unknown or unsuitable.
    """
    _check_names(elements)
    absent = {e.name: e for e in elements if isinstance(e, TemplateElement) and not e.present}
    _check_relations(elements, absent)
    scene = Scene(template=name)
    for element in sorted(elements, key=lambda element: element.follows_others):
        left_out = absent.get(element.name)
        scene = element.add(scene, assets) if left_out is None else left_out.leave_out(scene)
    if not scene.lights and not plates.has_plate(scene):
        scene = replace(scene, lights=(DEFAULT_LIGHT,))
    if scene.lanes:
        scene = replace(scene, interior_m=_bounds_of_lanes(scene.lanes))
    return replace(scene, focus=focus_region(scene))


def focus_region(scene: Scene) -> Region:
    """Box around the surfaces with objects; around all surfaces if there are none."""
    names = {name for group in scene.groups for name in group.surfaces}
    surfaces = [s for s in scene.surfaces if s.name in names] or list(scene.surfaces)
    if not surfaces:
        return Region()
    points = np.concatenate([_content_corners(surface) for surface in surfaces])
    low, high = points.min(axis=0), points.max(axis=0)
    center, size = 0.5 * (low + high), high - low
    x, y, z = (round(float(v), 6) for v in center)
    length_m, width_m, height_m = (round(float(v), 6) for v in size)
    return Region((x, y, z), (length_m, width_m, height_m))


def _bounds_of_lanes(lanes: Sequence[Lane]) -> tuple[se3.Vec3, se3.Vec3]:
    """Space for the cameras and lamps of a street: above its lanes and next to them."""
    points = np.concatenate([np.array(lane.center_m) for lane in lanes])
    low, high = points.min(axis=0), points.max(axis=0)
    x0, y0 = (float(v) - STREET_MARGIN_M for v in low[:2])
    x1, y1 = (float(v) + STREET_MARGIN_M for v in high[:2])
    return (x0, y0, float(low[2]) - 0.5), (x1, y1, float(high[2]) + STREET_HEIGHT_M)


def _check_names(elements: Sequence[Element]) -> None:
    seen: set[str] = set()
    for element in elements:
        if element.name in seen:
            raise errors.ConfigError(
                f"elements.{element.name}: two elements have this name; names must be unique"
            )
        seen.add(element.name)


def _check_relations(elements: Sequence[Element], absent: Collection[str]) -> None:
    """Raise ConfigError if an element of the scene needs an absent one."""
    for element in elements:
        if not isinstance(element, TemplateElement) or not element.present:
            continue
        for field, name in element.relations.items():
            if name in absent:
                raise errors.ConfigError(
                    f"elements.{element.name}.{field}: the element '{name}' is absent from this "
                    f"scene; expected one that is present, or present: false for '{element.name}'"
                )


def _content_corners(surface: SupportSurface) -> np.ndarray:
    x, y = 0.5 * surface.size_m[0], 0.5 * surface.size_m[1]
    top = min(CONTENT_HEIGHT_M, surface.clearance_m)
    corners = [[sx * x, sy * y, z] for sx in (-1, 1) for sy in (-1, 1) for z in (0.0, top)]
    return surface.T_world_surface.apply(np.array(corners))
