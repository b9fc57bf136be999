"""Signs painted on roads."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.roads.cross_section import RoadShape, non_default_fields, strips
from gen_data.scene_templates.element import Element, add_background, parametric_id
from gen_data.scene_templates.road import find_road

Sign = Literal[
    "straight", "left", "right", "straight_left", "straight_right", "left_right",
    "word", "bicycle", "blocked_area", "stop_line", "give_way", "zigzag",
]  # fmt: skip


class RoadMarking(Element):
    """A sign painted on a lane of a road: an arrow, a word, a symbol, a blocked area.

    Attributes:
        road: Name of the road.
        sign: An arrow by its directions; a word; a bicycle; a hatched blocked area; a line or a
            row of triangles across the lane; zigzag lines as at bus stops.
        text: Capital letters and digits of a word, such as STOP, 30, BUS, TAXI.
        lane: ``forward0`` is the lane next to the middle along the road, ``backward0`` the one
            against it; ``bicycle`` and ``parking`` are the strips on the right; ``middle`` =
            between the directions.
        station_m: Position of its foot along the road.
        offset_m: Distance to the left of the lane's middle, as seen along the road.
        length_m: Length of a blocked area or of zigzag lines.
        width_m: Their width; null = 2 m for these, else the lane's width.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["road_marking"] = "road_marking"
    road: str = Field(examples=["main"])
    sign: Sign = "straight"
    text: str = Field("STOP", min_length=1, max_length=12)
    lane: str = "forward0"
    station_m: float = Field(20.0, ge=0)
    offset_m: float = Field(0.0, ge=-10, le=10)
    length_m: float = Field(8.0, ge=1, le=100)
    width_m: float | None = Field(None, ge=0.5, le=12)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the paint as background."""
        where = f"elements.{self.name}"
        shape, parameters, T_world_road = find_road(scene, self.road, f"{where}.road")
        reach_m = self.length_m if self.sign in ("blocked_area", "zigzag") else 5.0
        across_m, lane_m, forward = self._place(shape)
        start, end = sorted((self.station_m, self.station_m + (reach_m if forward else -reach_m)))
        if start < 0.0 or end > shape.length_m:
            raise ConfigError(
                f"{where}.station_m: the sign would span {start:g} to {end:g} m of '{self.road}', "
                f"which is {shape.length_m:g} m long"
            )
        letters: frozenset[str] = declared("road_marking", "letters")
        if unknown := sorted(set(self.text) - letters):
            raise ConfigError(
                f"{where}.text: '{unknown[0]}' cannot be painted; expected letters of "
                f"{''.join(sorted(letters))}"
            )
        lane_m = 2.0 if self.sign in ("blocked_area", "zigzag") else lane_m - 0.3
        given: dict[str, Any] = {"sign": self.sign} if self.sign != "straight" else {}
        given |= {"text": f"_{self.text}"} if self.sign == "word" else {}
        given |= {"station_m": self.station_m, "across_m": round(across_m + self.offset_m, 6)}
        given |= {"area_m": self.length_m} if self.sign in ("blocked_area", "zigzag") else {}
        given |= {"width_m": round(self.width_m or lane_m, 6), "turned": float(not forward)}
        shown = ("age_years", "carriageway", "seed", "wear")
        given |= {k: parameters[k] for k in shown if k in parameters}
        asset = parametric_id("road_marking", **non_default_fields(shape), **given)
        return add_background(scene, assets, self.name, asset, T_world_road)

    def _place(self, shape: RoadShape) -> tuple[float, float, bool]:
        """``t`` of the lane's middle, its width, and whether it runs along the road."""
        known = {"middle": (0.0, max(1.0, shape.median_m), True)}
        for side in (1, -1):
            forward = shape.forward(side)
            for strip in strips(shape, side):
                place = (strip.middle_m, strip.width_m, forward)
                if strip.kind == "driving":
                    known[f"{'forward' if forward else 'backward'}{strip.number}"] = place
                elif strip.kind in ("bicycle", "parking") and side < 0:
                    known[strip.kind] = place
        if self.lane not in known:
            raise ConfigError(
                f"elements.{self.name}.lane: '{self.road}' has no lane '{self.lane}'; "
                f"expected one of {', '.join(sorted(known))}"
            )
        return known[self.lane]
