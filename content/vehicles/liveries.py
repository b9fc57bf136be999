"""Print on the sides of vans and service vehicles: names, emblems, stripes and chequers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_linear, hex_to_srgb8
from gen_data.content.procedural.textures import artwork as art
from gen_data.core import asset_types, se3
from gen_data.core.variant_rng import variant_rng

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

_TABLES = load_table(__package__, "liveries", tuple[str, ...])
_SIZE_PX = (256, 128)
_DRAWN_PX = (1024, 512)
TRADE = "trade"


@dataclass(frozen=True)
class Livery:
    """Colours, sRGB, pattern and word of a service's vehicles."""

    ground: str
    first: str
    second: str
    pattern: str
    word: str


def _read_services() -> dict[str, Livery]:
    rows = [row.split(maxsplit=5) for row in _TABLES["services"]]
    return {row[0]: Livery(*row[1:]) for row in rows}


SERVICES = _read_services()


def livery_id(kind: str, seed: int) -> str:
    """The asset id of a livery."""
    return f"texture/vehicle_livery?kind={kind}&seed={seed}"


def livery_ground(kind: str, seed: int) -> se3.Vec3:
    """Colour of the paint around the print, linear RGB."""
    return hex_to_linear(_find(kind, seed).ground)


def vehicle_livery(seed: int, kind: str) -> asset_types.TextureData:
    """The side of a vehicle, its front at the left border.

    Args:
        seed: Seed of the firm's name and emblem.
        kind: ``trade`` or a service of ``liveries.yaml``.

    Raises:
        AssetError: if the kind is unknown.
    """
    check_option("vehicle_livery", "kind", kind, (TRADE, *SERVICES))
    look = _find(kind, seed)
    ground, first, second = (hex_to_srgb8(c) for c in (look.ground, look.first, look.second))
    image = art.canvas(*_DRAWN_PX, ground)
    draw, (w, h) = art.pen(image), _DRAWN_PX
    rng = variant_rng("vehicle_livery", seed)
    if look.pattern == "check":
        for k in range(16):
            for row in range(2):
                box = [
                    k * w // 16,
                    h // 2 + row * h // 6,
                    (k + 1) * w // 16,
                    h // 2 + (row + 1) * h // 6,
                ]
                draw.rectangle(box, fill=first if (k + row) % 2 else second)
    elif look.pattern == "stripe":
        draw.rectangle([0, 0.58 * h, w, 0.8 * h], fill=first)
        draw.rectangle([0, 0.8 * h, w, 0.84 * h], fill=second)
    elif look.pattern == "lines":
        for at in (0.42, 0.62, 0.82):
            draw.rectangle([0, at * h, w, (at + 0.025) * h], fill=first)
    elif look.pattern == "swoosh":
        arc = [(w * k / 40, h * (0.95 - 0.4 * math.sin(math.pi * k / 60.0))) for k in range(41)]
        draw.polygon([*arc, (w, h), (0, h)], fill=first)
    ink = first if look.pattern != "lines" else second
    # Before the trade of a firm is its invented name.
    language = art.language_of(look.word.rpartition(" ")[2])
    art.text(image, (0.3, 0.14, 0.94, 0.46), look.word, ink, 3, language)
    if kind == TRADE:
        _draw_emblem(draw, rng.choose(("disc", "square", "bolt")), first, ground)
        number = "".join(str(int(rng.random() * 10)) for _ in range(7))
        ink = ground if look.pattern == "swoosh" else first
        art.text(image, (0.4, 0.86, 0.92, 0.98), f"0{number[:3]} {number[3:]}", ink, 1)
    return art.resize_texture(image, *_SIZE_PX)


def _draw_emblem(draw: ImageDraw, shape: str, ink: art.Color, ground: art.Color) -> None:
    box = [60, 70, 250, 260]
    if shape == "disc":
        draw.ellipse(box, fill=ink)
        draw.ellipse([110, 120, 200, 210], fill=ground)
    elif shape == "square":
        draw.rounded_rectangle(box, radius=40, fill=ink)
        draw.polygon([(155, 100), (220, 225), (90, 225)], fill=ground)
    else:
        draw.polygon(
            [(170, 60), (80, 180), (150, 180), (120, 275), (235, 140), (160, 140)], fill=ink
        )


def _find(kind: str, seed: int) -> Livery:
    """The service's livery, or the livery of a firm with a drawn name."""
    if kind != TRADE:
        return SERVICES[kind]
    rng = variant_rng("vehicle_livery/trade", seed)
    ground, ink = rng.choose(_TABLES["trades"]).split()
    name = "".join(rng.choose(_TABLES["syllables"]) for _ in range(2))
    word = rng.choose(_TABLES["words"])
    pattern = rng.choose(("plain", "stripe", "swoosh", "plain"))
    return Livery(ground, ink, ink, pattern, f"{name} {word}")
