"""Cars, vans, trucks, buses, motorcycles and bicycles."""

from __future__ import annotations

from collections.abc import Mapping

from gen_data.generator.assets.procedural.family import Family, Lazy, TextureFamily


def _vehicle(name: str, variants: int, mass_kg: float, module: str, **parameters: object) -> Family:
    """A family whose facts the function ``<name>_facts`` tells."""
    path = f"{__name__}.{module}:{name}"
    return Family(
        name=name,
        category=name,
        tags=tuple(sorted({"vehicle", name})),
        variants=variants,
        mass_kg=mass_kg,
        stackable=False,
        version=6,
        parameters=parameters,
        build=Lazy(path),
        facts=Lazy(f"{path}_facts"),
    )


FAMILIES: Mapping[str, Family] = {
    family.name: family
    for family in (
        _vehicle("car", 48, 1400.0, "car", steer_deg=0.0),
        _vehicle("van", 16, 2200.0, "van", steer_deg=0.0),
        _vehicle("truck", 16, 7500.0, "truck"),
        _vehicle("bus", 8, 12000.0, "bus"),
        _vehicle("motorcycle", 12, 200.0, "motorcycle"),
        _vehicle("bicycle", 12, 15.0, "bicycle"),
        _vehicle("cyclist", 16, 90.0, "bicycle"),
    )
}

TEXTURES: Mapping[str, TextureFamily] = {
    "licence_plate": TextureFamily(
        "licence_plate",
        ("printed",),
        12,
        1,
        Lazy(f"{__name__}.plates:licence_plate"),
        {"rows": 1},
    )
}
