"""Groups of objects on surfaces, at first in rows and clear of other elements."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.assets.families import declared
from gen_data.config.base_model import Strict
from gen_data.core import errors
from gen_data.core.asset_types import Asset
from gen_data.core.asset_words import check_tags, check_words
from gen_data.core.bounded_cache import CountCache, ObjectCache
from gen_data.core.interfaces import AssetIndex
from gen_data.core.members import Member, add_members
from gen_data.core.scene import ObjectGroup, Placement, Scene, SupportSurface
from gen_data.core.se3 import SE3, Vec3
from gen_data.scene_templates import element

LAYERS: dict[Placement, int] = {
    "drop": 4, "scatter": 1, "grid": 1, "stack": 4, "row": 1, "pile": 4,
    "hang": 1,
}  # fmt: skip
"""Largest number of objects that start above one another, by placement."""
MARGIN_M = 0.02
"""Gap between objects and other elements on the surface."""
_GAPS_M = (0.24, 0.18, 0.12, 0.08, 0.05, 0.03, 0.015, 0.005)
_STEP_M = 0.02
_TURNS_MAX = 100_000
"""Limit on the steps, rows and layers tried for one object; large surfaces need fewer."""
_CHOICES = 256
_resolved: ObjectCache[CountCache[tuple[str, ...]]] = ObjectCache(1)
"""Ids of the latest choices, of the latest library: most scenes have the same choices."""


class AssetChoice(Strict):
    """Assets of a group: the union of the lists, without the excluded ones.

    Attributes:
        tags: Assets with all of these tags.
        any_of: Assets with at least one of these tags.
        ids: Assets by id; the name of a family stands for all of its variants.
        exclude: Tags, categories or subcategories, such as ``apple/half``, to leave out.
        prefer: Tags in order of preference: each category keeps only its assets with the first of
            these tags that it has.
    """

    tags: tuple[str, ...] = ()
    any_of: tuple[str, ...] = ()
    ids: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    prefer: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _has_a_list(self) -> "AssetChoice":
        if not (self.tags or self.any_of or self.ids):
            raise ValueError("expected tags, any_of or ids")
        return self

    def resolve(self, assets: AssetIndex, field: str) -> tuple[str, ...]:
        """Find the ids of all matching assets, sorted.

        Raises:
            ConfigError: no asset matches, or a tag or an excluded word is unknown.
            AssetError: an id is unknown.
        """
        known = _resolved.get(assets, lambda: CountCache(_CHOICES))
        kept = known.get(repr(self), lambda: self._resolve(assets, field))
        if not kept:
            raise errors.ConfigError(f"{field}: no asset matches; expected other tags or ids")
        return kept

    def _resolve(self, assets: AssetIndex, field: str) -> tuple[str, ...]:
        found = {a.asset_id: a for a in assets.find(self.tags)} if self.tags else {}
        for tag in self.any_of:
            found |= {a.asset_id: a for a in assets.find((tag,))}
        for asset_id in self.ids:
            members = assets.variants(asset_id) or (assets.get(asset_id),)
            found |= {a.asset_id: a for a in members}
        for key in ("tags", "any_of", "prefer"):
            check_tags(getattr(self, key), assets, f"{field}.{key}")
        check_words(self.exclude, found.values(), assets, f"{field}.exclude")
        fitting = [a for a in found.values() if not any(map(a.has_word, self.exclude))]
        return tuple(sorted(asset.asset_id for asset in self._select_preferred(fitting)))

    def _select_preferred(self, fitting: list[Asset]) -> Iterator[Asset]:
        by_category: dict[str, list[Asset]] = {}
        for asset in fitting:
            by_category.setdefault(asset.category, []).append(asset)
        for same in by_category.values():
            for tag in self.prefer:
                chosen = [asset for asset in same if tag in asset.tags]
                if chosen:
                    yield from chosen
                    break
            else:
                yield from same


class Objects(element.Element):
    """Objects on one or several surfaces; the ``objects`` randomizer of the same name draws them.

    Attributes:
        on: Name of a surface, or of an element with several surfaces (a shelf).
        count: Nominal number of objects.
        assets: Assets to choose from.
        placement: drop: objects fall from above; scatter: they stand apart; grid: they stand in
            cells; stack: they stand in towers; row: they stand side by side and touch, one row
            behind another; pile: they fall on one spot, next to and on top of one another; hang:
            they hang in the leaves of a ``fruit_bough``, on their stalks.
        annotate: Whether to write labels for them.
    """

    related: ClassVar[tuple[str, ...]] = ("on",)

    type: Literal["objects"] = "objects"
    on: str = Field(examples=["table"])
    count: int = Field(8, ge=0, le=500)
    assets: AssetChoice = Field(examples=[{"tags": ["household"]}])
    placement: Placement = "drop"
    annotate: bool = True

    @property
    def follows_others(self) -> bool:
        """True: objects keep clear of all other elements on their surfaces."""
        return True

    def leave_out(self, scene: Scene) -> Scene:
        """Return the scene with a group of no objects, whose name randomizers accept."""
        return replace(scene, groups=(*scene.groups, empty_group(self.name, self.placement)))

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the group, and its objects in rows on its surfaces, clear of other elements."""
        surfaces = element.find_surfaces(scene, self.on, f"elements.{self.name}.on")
        bodies = (scene.body(surface.body) for surface in surfaces)
        if self.placement == "hang" and not any(declared(b.asset, "hooks_m", None) for b in bodies):
            raise errors.ConfigError(
                f"elements.{self.name}.placement: nothing can hang on '{self.on}'; expected an "
                "element of type fruit_bough as 'on', or another placement"
            )
        discs = [find_keep_out_discs(scene, surface, assets) for surface in surfaces]
        group = ObjectGroup(
            name=self.name,
            surfaces=tuple(s.name for s in surfaces),
            assets=self.assets.resolve(assets, f"elements.{self.name}.assets"),
            count=self.count,
            placement=self.placement,
            annotated=self.annotate,
            keep_out=tuple(disc for some in discs for disc in some),
        )
        scene = replace(scene, groups=(*scene.groups, group))
        share = -(-self.count // len(surfaces))
        for number, surface in enumerate(surfaces):
            here = range(self.count)[number * share : (number + 1) * share]
            chosen = [self._choose_asset(group, k, surface, assets) for k in here]
            points = self._place(chosen, surface, group, assets)
            members = []
            for asset, point in zip(chosen, points, strict=True):
                pose = element.stand_upright(
                    assets, asset, surface.T_world_surface @ SE3(point)
                ).rounded()
                mass_kg = assets.get(asset).mass_kg
                members.append(Member(asset, pose, motion="dynamic", mass_kg=mass_kg))
            scene = add_members(scene, group, members, assets, first=here.start)
        return scene

    def _choose_asset(
        self, group: ObjectGroup, number: int, surface: SupportSurface, assets: AssetIndex
    ) -> str:
        """Choose the asset of an object: evenly from the group, or the next one that fits."""
        first = (number * len(group.assets)) // max(self.count, 1)
        for asset in (*group.assets[first:], *group.assets[:first]):
            length_m, width_m, height_m = element.extent_m(assets, asset)
            fits = length_m <= surface.size_m[0] and width_m <= surface.size_m[1]
            if fits and height_m <= surface.clearance_m:
                return asset
        raise errors.ConfigError(
            f"elements.{self.name}.assets: every asset is larger than surface '{surface.name}'; "
            "expected smaller assets or a larger surface"
        )

    def _place(
        self, chosen: list[str], surface: SupportSurface, group: ObjectGroup, assets: AssetIndex
    ) -> list[Vec3]:
        """Positions of the objects of one surface, in its frame [m]."""
        T_surface_world = surface.T_world_surface.inverse()
        height_m = surface.T_world_surface.translation_m[2]
        discs: list[Vec3] = []
        for x, y, radius_m in group.keep_out:
            here = (T_surface_world @ SE3((x, y, height_m))).translation_m
            discs.append((here[0], here[1], radius_m))
        sizes_m = [element.extent_m(assets, asset) for asset in chosen]
        points = place_in_rows(sizes_m, surface, discs, LAYERS[self.placement])
        if points is None:
            raise errors.ConfigError(
                f"elements.{self.name}.count: {len(chosen)} objects do not fit on surface "
                f"'{surface.name}' of {surface.size_m[0]:g} m x {surface.size_m[1]:g} m; "
                "expected fewer objects or a larger surface"
            )
        return points


def empty_group(name: str, placement: Placement) -> ObjectGroup:
    """The group of an absent element: it has no assets, and gets no objects."""
    return ObjectGroup(name, (), (), 0, placement, annotated=False)


def find_keep_out_discs(
    scene: Scene, surface: SupportSurface, assets: AssetIndex
) -> tuple[Vec3, ...]:
    """Discs ``(x, y, radius)`` [m], world, around the static bodies on a surface: arms, bins."""
    discs = []
    for body in scene.bodies:
        if body.motion == "dynamic" or body.name == surface.body:
            continue
        low, high = assets.bounds_m(body.asset)
        corners = np.array([[x, y, z] for x in (low[0], high[0])
                            for y in (low[1], high[1]) for z in (low[2], high[2])])  # fmt: skip
        here = (surface.T_world_surface.inverse() @ body.T_world_body).apply(corners * body.scale)
        bottom, top = here.min(axis=0), here.max(axis=0)
        middle, half = 0.5 * (bottom + top), 0.5 * (top - bottom)
        over = np.abs(middle[:2]) <= 0.5 * np.array(surface.size_m) + half[:2]
        if abs(bottom[2]) < MARGIN_M and over.all():
            x, y, _ = surface.T_world_surface.apply(np.array([middle[0], middle[1], 0.0]))
            radius_m = math.hypot(float(half[0]), float(half[1])) + MARGIN_M
            discs.append((round(float(x), 6), round(float(y), 6), round(radius_m, 6)))
    return tuple(discs)


def place_in_rows(
    sizes_m: Sequence[Vec3], surface: SupportSurface, discs: Sequence[Vec3], layers: int
) -> list[Vec3] | None:
    """Place upright boxes in rows on a surface, with the largest gap that fits.

    Args:
        sizes_m: Extents of the boxes.
        surface: Supporting surface.
        discs: Keep-out discs ``(x, y, radius)`` in the surface's frame.
        layers: Largest number of boxes above one another.

    Returns:
        Centre of each box's base in the surface's frame [m]; None if they do not fit.
    """
    for gap_m in _GAPS_M:
        points = _pack_rows(sizes_m, surface, discs, layers, gap_m)
        if points is not None:
            return points
    return None


def _pack_rows(
    sizes_m: Sequence[Vec3],
    surface: SupportSurface,
    discs: Sequence[Vec3],
    layers: int,
    gap_m: float,
) -> list[Vec3] | None:
    """Place boxes row by row from the low corner, then layer by layer."""
    half_x, half_y = (0.5 * size for size in surface.size_m)
    left, front = -half_x + 0.5 * gap_m, -half_y + 0.5 * gap_m
    x, y, z, layer = left, front, 0.0, 1
    row_m = layer_m = 0.0
    points: list[Vec3] = []
    for length_m, width_m, height_m in sizes_m:
        for _ in range(_TURNS_MAX):
            if x + length_m > half_x:
                if x == left:
                    return None
                x, y, row_m = left, y + max(row_m, _STEP_M) + gap_m, 0.0
            elif y + width_m > half_y:
                if y == front or layer == layers:
                    return None
                x, y, z, layer = left, front, z + layer_m + gap_m, layer + 1
                row_m = layer_m = 0.0
            elif z + height_m > surface.clearance_m:
                return None
            elif _touches_disc(discs, x, y, length_m, width_m):
                x += _STEP_M
            else:
                break
        else:
            return None
        points.append((x + 0.5 * length_m, y + 0.5 * width_m, z))
        x += length_m + gap_m
        row_m, layer_m = max(row_m, width_m), max(layer_m, height_m)
    return points


def _touches_disc(
    discs: Sequence[Vec3], x: float, y: float, length_m: float, width_m: float
) -> bool:
    """Whether the rectangle with this low corner touches a disc."""
    for center_x, center_y, radius_m in discs:
        near_x = min(max(center_x, x), x + length_m)
        near_y = min(max(center_y, y), y + width_m)
        if math.hypot(near_x - center_x, near_y - center_y) < radius_m:
            return True
    return False
