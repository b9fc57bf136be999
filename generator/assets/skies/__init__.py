"""Analytic skies with sun and clouds."""

from __future__ import annotations

from collections.abc import Mapping

from gen_data.generator.assets.procedural.family import EnvironmentFamily, Lazy

ENVIRONMENTS: Mapping[str, EnvironmentFamily] = {
    # Not offered for selection: a sky without the sun that belongs to it is wrong.
    "sky": EnvironmentFamily(
        "sky",
        ("outdoor",),
        0,
        1,
        Lazy("gen_data.generator.assets.skies.sky:sky"),
        {
            "sun_altitude_deg": 40.0,
            "turbidity": 2.5,
            "cloudiness": 0.0,
            "ground_albedo": 0.18,
        },
        stored=False,
    )
}
