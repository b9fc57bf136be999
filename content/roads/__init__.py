"""Surfaces of roads and junctions, and their textures."""

from collections.abc import Mapping
from dataclasses import fields

from gen_data.assets.family import Family, Lazy, load_families
from gen_data.roads.cross_section import RoadShape
from gen_data.roads.junction_shape import JunctionShape
from gen_data.roads.parking_shape import ParkingShape
from gen_data.roads.roundabout_shape import RoundaboutShape


def _surface(path: str, **parameters: object) -> Family:
    """A surface as streets draw them; those along roads rarely have the same shape twice."""
    build, name = Lazy(f"gen_data.content.roads.{path}"), path.partition(":")[2]
    facts: dict[str, object] = {"draped": "land" if name in ("ground", "fields") else "layers"}
    if name == "road_marking":
        facts["letters"] = Lazy(f"{__name__}.painted_signs:LETTERS")
        facts["writing"] = Lazy(f"{__name__}.road_marking:road_marking_writing")
    is_drawn = bool({"bends", "arms_deg", "curvature_per_m"} & parameters.keys())
    return Family(
        name, name, ("street",), 0, 0.0, False, 2, parameters, build, stored=not is_drawn,
        declares=facts,
    )  # fmt: skip


_SHAPE, _JUNCTION, _ROUNDABOUT, _PARKING = (
    {field.name: field.default for field in fields(shape)}
    for shape in (RoadShape, JunctionShape, RoundaboutShape, ParkingShape)
)
_FIELDS: dict[str, object] = {
    "length_m": 150.0, "curvature_per_m": 0.0, "side": 1.0, "inner_m": 8.0, "depth_m": 80.0,
    "crops": "maize_wheat_meadow", "seed": 0, "bends": (),
}  # fmt: skip
"""Fields of ``roads.fields_shape.FieldsShape``, which needs no import of numpy here."""
_LOOKS: dict[str, object] = {
    "seed": 0, "wear": 0.3, "paving": "paving", "ground": "grass", "carriageway": "asphalt",
    "age_years": -1.0, "coating": "none", "center_color": "white",
}  # fmt: skip
"""Fields of ``road_materials.StreetLook``, which needs no import of numpy here."""

FAMILIES: Mapping[str, Family] = {
    family.name: family
    for family in (
        _surface(
            "road:road",
            **_SHAPE,
            **_LOOKS,
            markings="dashed",
            edge_lines="none",
            dash_m=(3.0, 6.0),
            line_m=0.12,
            apron_m=6.0,
            rails=(0.0, 0.0),
            arrows=(0.0, 0.0),
            tram=0.0,
        ),
        _surface("junction:junction", **_JUNCTION, **_LOOKS, crossings="zebra"),
        _surface("roundabout:roundabout", **_ROUNDABOUT, **_LOOKS, crossings="zebra"),
        _surface("road:crosswalk", **_SHAPE, **_LOOKS, station_m=20.0, width_m=4.0, style="zebra"),
        _surface(
            "road_marking:road_marking",
            **_SHAPE,
            **_LOOKS,
            sign="straight",
            text="_STOP",
            station_m=20.0,
            across_m=0.0,
            turned=0.0,
            area_m=8.0,
            width_m=2.8,
        ),
        _surface("parking_area:parking_area", **_PARKING, **_LOOKS),
        _surface("fields:fields", **_FIELDS),
        _surface("paved_area:paved_area", size_m=(30.0, 20.0), cover="paving", seed=0),
        _surface("driveway:driveway", seed=0, width_m=6.0, depth_m=2.5, kerb_m=0.12, rise_m=0.18),
        _surface("tram_wires:contact_wires", span_m=30.0, left_m=6.5, right_m=6.5, tracks_m=1.7),
        _surface("level_crossing:level_crossing", **_SHAPE, **_LOOKS, station_m=60.0),
        _surface("ground:ground", seed=0, size_m=(800.0, 800.0), cover="grass", relief_m=0.04),
    )
}

TEXTURES = load_families(__name__).textures
