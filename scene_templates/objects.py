"""Groups of objects on surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from pydantic import Field, model_validator

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.asset_types import Asset
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.members import Member, add_members
from gen_data.generator.core.scene import ObjectGroup, Placement, Scene, SupportSurface
from gen_data.generator.core.se3 import SE3, Vec3
from gen_data.scene_templates.element import Element, extent_m, find_surfaces, stand_upright
from gen_data.scene_templates.rows import LAYERS, find_keep_out_discs, place_in_rows


class AssetChoice(Strict):
    """Assets of a group: the union of the lists, without the excluded ones.

    Attributes:
        tags: Assets with all of these tags.
        any_of: Assets with at least one of these tags.
        ids: Assets by id; the name of a family stands for all of its variants.
        exclude: Tags or categories to leave out.
        prefer: Tags in order of preference: each category keeps only its assets with the first of
            these tags that it has.
    """

    tags: tuple[str, ...] = ()
    any_of: tuple[str, ...] = ()
    ids: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    prefer: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _has_a_list(self) -> AssetChoice:
        if not (self.tags or self.any_of or self.ids):
            raise ValueError("expected tags, any_of or ids")
        return self

    def resolve(self, assets: AssetIndex, field: str) -> tuple[str, ...]:
        """Find the ids of all matching assets, sorted.

        Raises:
            ConfigError: no asset matches.
            AssetError: an id is unknown.
        """
        found = {a.asset_id: a for a in assets.find(self.tags)} if self.tags else {}
        for tag in self.any_of:
            found |= {a.asset_id: a for a in assets.find((tag,))}
        for asset_id in self.ids:
            family = [a for a in assets.find(()) if a.asset_id.partition("?")[0] == asset_id]
            members = family or [assets.get(asset_id)]
            found |= {a.asset_id: a for a in members}
        fitting = [
            asset
            for asset in found.values()
            if not {asset.category, *asset.tags} & set(self.exclude)
        ]
        kept = sorted(asset.asset_id for asset in self._select_preferred(fitting))
        if not kept:
            raise ConfigError(f"{field}: no asset matches; expected other tags or ids")
        return tuple(kept)

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


class Objects(Element):
    """Objects on one or several surfaces; the ``objects`` randomizer of the same name draws them.

    Attributes:
        on: Name of a surface, or of an element with several surfaces (a shelf).
        count: Nominal number of objects.
        assets: Assets to choose from.
        placement: drop: objects fall from above; scatter: they stand apart; grid: they stand in
            rows; stack: they stand in towers.
        annotate: Whether to write labels for them.
    """

    type: Literal["objects"] = "objects"
    on: str
    count: int = Field(8, ge=0, le=500)
    assets: AssetChoice
    placement: Placement = "drop"
    annotate: bool = True

    @property
    def follows_others(self) -> bool:
        """True: objects keep clear of all other elements on their surfaces."""
        return True

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the group, and its objects in rows on its surfaces, clear of other elements."""
        surfaces = find_surfaces(scene, self.on, f"elements.{self.name}.on")
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
                pose = stand_upright(assets, asset, surface.T_world_surface @ SE3(point)).rounded()
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
            length_m, width_m, height_m = extent_m(assets, asset)
            fits = length_m <= surface.size_m[0] and width_m <= surface.size_m[1]
            if fits and height_m <= surface.clearance_m:
                return asset
        raise ConfigError(
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
        sizes_m = [extent_m(assets, asset) for asset in chosen]
        points = place_in_rows(sizes_m, surface, discs, LAYERS[self.placement])
        if points is None:
            raise ConfigError(
                f"elements.{self.name}.count: {len(chosen)} objects do not fit on surface "
                f"'{surface.name}' of {surface.size_m[0]:g} m x {surface.size_m[1]:g} m; "
                "expected fewer objects or a larger surface"
            )
        return points
