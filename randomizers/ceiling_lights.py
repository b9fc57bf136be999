"""Light panels on the ceiling of a room."""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import interfaces, photometry, se3, streams
from gen_data.core.scene import PANEL_KINDS, Light, LightKind, Scene
from gen_data.randomizers import base, color_space


class CeilingLights(base.RandomizerBase):
    """Replaces the lights by a grid of panels on the ceiling, all facing straight down.

    Attributes:
        kind: Shape of all panels: rectangle or disk.
        rows, columns: Size of the grid along Y and X of the room.
        size_m: Sides of a rectangle along X and Y; the first is the diameter of a disk.
        luminous_flux_lm: Flux of one panel; an office panel of 0.6 m by 0.6 m emits 4000 lm.
        temperature_k: Colour temperature of all panels.
        broken: Whether a panel is dark.
        visible: Whether panels appear in images, as housings with a bright front.
        keep_existing: Whether to keep the lights already in the scene.
    """

    type: Literal["ceiling_lights"] = "ceiling_lights"
    kind: Annotated[dist.Name, dist.OneOf(PANEL_KINDS)] = dist.Constant("rectangle")
    rows: dist.Count = dist.UniformInteger(1, 2)
    columns: dist.Count = dist.UniformInteger(2, 3)
    size_m: tuple[Annotated[float, Field(gt=0.0)], Annotated[float, Field(gt=0.0)]] = (0.6, 0.6)
    luminous_flux_lm: dist.NonNegative = dist.Uniform(2500.0, 4500.0)
    temperature_k: color_space.Temperature = dist.Uniform(2700.0, 6500.0)
    broken: dist.Flag = dist.Probability(0.05)
    visible: bool = True
    keep_existing: bool = False

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with a grid of panels. Raises ConfigError if the kind is unknown."""
        scene = scene if self.keep_existing else photometry.remove_lights(scene)
        kind = self._draw_kind(rng)
        rows, columns = self.rows.draw(rng), self.columns.draw(rng)
        color = color_space.temperature_to_linear(self.temperature_k.draw(rng))
        flux_lm = self.luminous_flux_lm.draw(rng)
        for k in range(rows * columns):
            at_m = _grid_point(scene, k // columns, k % columns, rows, columns)
            light = replace(self._make_panel(f"{self.name}/{k}", kind, at_m), color=color)
            lit = 0.0 if self.broken.draw(rng) else flux_lm
            light = photometry.scale_to_flux(light, lit)
            if self.visible:
                materials = assets.materials(photometry.fixture_asset(light))
                scene, light = photometry.add_fixture(scene, light, materials)
            if lit > 0.0:
                scene = replace(scene, lights=(*scene.lights, light))
        return scene

    def _draw_kind(self, rng: streams.Rng) -> LightKind:
        return "rectangle" if self.kind.draw(rng) == "rectangle" else "disk"

    def _make_panel(self, name: str, kind: LightKind, at_m: se3.Vec3) -> Light:
        return Light(
            name,
            kind,
            position_m=at_m,
            direction=(0.0, 0.0, -1.0),
            size_m=self.size_m,
            radius_m=0.5 * self.size_m[0],
        )


def _grid_point(scene: Scene, row: int, column: int, rows: int, columns: int) -> se3.Vec3:
    """Centre of a grid cell on the ceiling [m]."""
    (x0, y0, _), (x1, y1, z1) = scene.interior_m
    x = x0 + (x1 - x0) * (column + 0.5) / columns
    y = y0 + (y1 - y0) * (row + 0.5) / rows
    return (round(x, 6), round(y, 6), z1)
