"""The path-traced tier against Mitsuba 3: the same triangles and lights, other code.

Both renderers make independent images of other seeds. Their means are compared: over the image, as
the eye sees them (FLIP), and pixel by pixel with Welch's t-test, whose level is corrected for the
number of pixels (Sidak 1967), as Mitsuba's own tests of its integrators do.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from gen_data.core.asset_types import Material, TextureData
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.scene.environment_maps import texel_directions
from gen_data.sensors.camera.exposure import meter_ev100, saturation_cd_m2
from gen_data.sensors.camera.isp import display_values
from tests.renderers import fake_library
from tests.renderers.mitsuba_scene import mitsuba, mitsuba_images, mitsuba_scene
from tests.renderers.paths import replicates_of

SIZE_PX = (32, 32)
FAMILY_LEVEL = 0.01
"""Probability that equal renderers fail one test of a picture."""
RGB = tuple[float, float, float]


def matte(*color: float) -> tuple[Material, ...]:
    """Lambert's surface: without a specular layer it is the same in both renderers."""
    rgb = color if len(color) == 3 else (color[0],) * 3
    return (Material(base_color=rgb, roughness=1.0, specular=0.0),)


def rgb(*color: float) -> dict[str, Any]:
    return {"type": "rgb", "value": [*(color if len(color) == 3 else color * 3)]}


@dataclass(frozen=True)
class Picture:
    """One scene in both renderers.

    Attributes:
        bsdfs: Mitsuba's, by body.
        exact: Whether both have the same model of the surfaces, so that pixels must agree.
    """

    scene: Scene
    camera: Camera
    library: fake_library.FakeLibrary
    bsdfs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    environment: Callable[[], dict[str, Any]] | None = None
    exact: bool = True


def cornell() -> Picture:
    """A closed box: diffuse surfaces, many bounces, one rectangle."""
    library = fake_library.FakeLibrary({
        "room": fake_library.room_mesh((2, 2, 2), matte(0.7)),
        "wall": fake_library.box_mesh((0.02, 2, 2), matte(0.6, 0.05, 0.05)),
        "shade": fake_library.plane_mesh(0.6, matte(0.0)),
        "box": fake_library.box_mesh((0.5, 0.5, 1.0), matte(0.3, 0.6, 0.2)),
        "ball": fake_library.sphere_mesh(0.35, 32, matte(0.7)),
    })  # fmt: skip
    bodies = (
        Body("room", "room"),
        Body("wall", "wall", SE3((-0.98, 0.0, 1.0))),
        # Mitsuba's lamp has a black back.
        Body("shade", "shade", SE3((0.0, 0.0, 1.951))),
        Body("box", "box", SE3((-0.35, 0.3, 0.5))),
        Body("ball", "ball", SE3((0.4, -0.1, 0.35))),
    )
    lamp = Light(
        "lamp", "rectangle", (0.0, 0.0, 1.95), size_m=(0.6, 0.6), side=(1.0, 0.0, 0.0),
        intensity_cd=360.0,
    )  # fmt: skip
    scene = Scene("cornell", bodies, lights=(lamp,), environment=fake_library.DARK)
    return Picture(
        scene, fake_library.camera_at((0, -0.95, 1.0), (0, 1, 0.9), SIZE_PX, 80.0), library
    )


PANEL = Light(
    "panel", "rectangle", (1.2, -1.0, 2.4), (-0.408248, 0.408248, -0.816497),
    side=(0.707107, 0.707107, 0.0), size_m=(1.0, 0.6), intensity_cd=700.0,
)  # fmt: skip


def panel_pose(behind_m: float) -> SE3:
    """Behind the panel: X along its side, Z its normal."""
    normal, side = np.array(PANEL.direction), np.array(PANEL.side)
    T = np.eye(4)
    T[:3, :3] = np.stack([side, np.cross(normal, side), normal], axis=-1)
    T[:3, 3] = np.array(PANEL.position_m) - behind_m * normal
    return SE3.from_matrix(T)


def still_life(
    material: Material,
    bsdf: Mapping[str, Any],
    *lights: Light,
    exact: bool = True,
    sky: float = 60.0,
) -> Picture:
    library = fake_library.FakeLibrary({
        "ground": fake_library.plane_mesh(6.0, matte(0.4, 0.35, 0.3)),
        "ball": fake_library.sphere_mesh(0.5, 64, (material,)),
        "box": fake_library.box_mesh((0.3, 0.3, 0.6), matte(0.1, 0.2, 0.6)),
        "back": fake_library.box_mesh((*PANEL.size_m, 1e-3), matte(0.0)),
    })  # fmt: skip
    bodies = (
        Body("ground", "ground"),
        # Mitsuba's panel hides the sky behind it.
        Body("back", "back", panel_pose(1e-3)),
        Body("ball", "ball", SE3((0.0, 0.0, 0.52))),
        Body("box", "box", SE3((-0.8, 0.7, 0.3))),
    )
    environment = Environment(luminance_cd_m2=sky)
    scene = Scene("still life", bodies, lights=lights, environment=environment)
    camera = fake_library.camera_at((0.2, -2.6, 1.3), (0.0, 0.0, 0.4), SIZE_PX, 45.0)
    return Picture(scene, camera, library, {"ball": bsdf}, exact=exact)


DISK = Light(
    "disk", "disk", (-1.5, -1.2, 2.0), (0.6, 0.48, -0.64), radius_m=0.4, intensity_cd=500.0
)
BALL = Light("bulb", "sphere", (-0.2, 0.9, 1.9), radius_m=0.15, intensity_cd=300.0)
SUN = Light(
    "sun", "sun", direction=(0.48, 0.6, -0.64), illuminance_lux=900.0, angular_radius_rad=1e-4
)
SPOT = Light(
    "spot", "spot", (-0.9, -1.4, 2.0), (0.45, 0.7, -0.554), radius_m=2e-3, intensity_cd=900.0,
    cone_rad=0.35, even=0.999,
)  # fmt: skip


def metal() -> Picture:
    """Schlick's reflectance over GGX; separable masking in Mitsuba, height-correlated here."""
    gold = Material(base_color=(0.9, 0.7, 0.3), metallic=1.0, roughness=0.2)
    bsdf = {
        "type": "principled", "base_color": rgb(0.9, 0.7, 0.3), "metallic": 1.0, "roughness": 0.2,
    }  # fmt: skip
    return still_life(gold, bsdf, PANEL, exact=False)


def plastic() -> Picture:
    """A smooth layer over a matte one, which Mitsuba couples to it in another way."""
    red = Material(base_color=(0.35, 0.03, 0.02), roughness=0.3)
    bsdf = {
        "type": "roughplastic", "distribution": "ggx", "alpha": 0.09, "int_ior": 1.5,
        "diffuse_reflectance": rgb(0.35, 0.03, 0.02),
    }  # fmt: skip
    return still_life(red, bsdf, PANEL, exact=False)


def solid_glass() -> Picture:
    glass = Material(base_color=(1, 1, 1), roughness=0.0, transmission=1.0, thin=False, ior=1.5)
    bsdf = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.002025, "int_ior": 1.5}
    return still_life(glass, bsdf)


def rough_glass() -> Picture:
    glass = Material(base_color=(1, 1, 1), roughness=0.4, transmission=1.0, thin=False, ior=1.5)
    bsdf = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.16, "int_ior": 1.5}
    return still_life(glass, bsdf, exact=False)


def thin_glass() -> Picture:
    glass = Material(base_color=(1, 1, 1), roughness=0.0, transmission=1.0, thin=True, ior=1.5)
    return still_life(glass, {"type": "thindielectric", "int_ior": 1.5})


def veil() -> Picture:
    """Opacity, whose shadow lets light through too.

    Mitsuba's shadow rays do not: under the sky alone its paths find all light by themselves.
    """
    cloth = replace(matte(0.8, 0.2, 0.2)[0], opacity=0.4)
    lambert = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(0.8, 0.2, 0.2)}}
    return still_life(cloth, {"type": "mask", "opacity": 0.4, "bsdf": lambert})


def coated() -> Picture:
    """A black surface under a coat is the coat alone."""
    paint = Material(base_color=(0, 0, 0), specular=0.0, coat=1.0, coat_roughness=0.2)
    bsdf = {
        "type": "roughplastic", "distribution": "ggx", "alpha": 0.04, "int_ior": 1.5,
        "diffuse_reflectance": rgb(0.0),
    }  # fmt: skip
    return still_life(paint, bsdf, PANEL, exact=False)


def lamps() -> Picture:
    """Lamps that are bodies in Mitsuba, where they do not shade each other."""
    return still_life(
        matte(0.7)[0],
        {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(0.7)}},
        PANEL, DISK, BALL,
        sky=0.0,
    )  # fmt: skip


def sun_and_spot() -> Picture:
    """Lamps that are points in Mitsuba, and small spheres here."""
    picture = lamps()
    return replace(picture, scene=replace(picture.scene, lights=(SUN, SPOT)))


def textured() -> Picture:
    """Four squares of colour, whose borders are interpolated differently.

    V goes down in Mitsuba.
    """
    colors = np.array([[[230, 40, 30], [40, 200, 60]], [[30, 60, 220], [240, 230, 200]]], np.uint8)
    albedo = np.repeat(np.repeat(colors, 256, axis=0), 256, axis=1)
    picture = lamps()
    cloth = (replace(matte(1.0)[0], texture="cloth"),)
    meshes = {**picture.library.meshes, "ground": fake_library.plane_mesh(4.0, cloth)}
    library = fake_library.FakeLibrary(meshes, {"cloth": TextureData(albedo)})
    image = mitsuba().Bitmap(albedo[::-1].copy())
    bitmap = {"type": "bitmap", "bitmap": image, "filter_type": "bilinear"}
    lambert = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": bitmap}}
    scene = replace(picture.scene, lights=(PANEL,))
    return replace(picture, scene=scene, library=library, bsdfs={"ground": lambert}, exact=False)


def sky_of(directions: np.ndarray) -> np.ndarray:
    """A bright, coloured patch in a dim gradient; any resolution, any frame."""
    x, y, z = np.moveaxis(directions, -1, 0)
    towards = np.maximum(0.48 * x - 0.6 * y + 0.64 * z, 0.0)
    patch = np.stack([120.0 * towards**200, 90.0 * towards**200, 50.0 * towards**200], axis=-1)
    return (patch + np.stack([1.0 + 0.5 * z, 1.0 + 0.4 * x, 1.3 + 0.6 * y], axis=-1)) * 0.5


def environment_lit() -> Picture:
    height = 512
    own = sky_of(texel_directions(height)[0]).astype(np.float32)
    # Mitsuba's image has its first and last rows at the poles, Y up, and goes around from -Z
    # by way of -X.
    polar = np.pi * np.arange(height) / (height - 1.0)
    azimuth = 2.0 * np.pi * (np.arange(2 * height) + 0.5) / (2.0 * height)
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    theirs = np.stack([np.sin(p) * np.sin(a), np.cos(p), -np.sin(p) * np.cos(a)], axis=-1)
    to_world = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
    their_image = sky_of(theirs @ to_world[:3, :3].T).astype(np.float32)

    def emitter() -> dict[str, Any]:
        mi = mitsuba()
        return {
            "type": "envmap", "bitmap": mi.Bitmap(their_image * 100.0),
            "to_world": mi.ScalarTransform4f(to_world),
        }  # fmt: skip

    picture = lamps()
    library = fake_library.FakeLibrary(picture.library.meshes, None, {"patch": own})
    environment = Environment("patch", luminance_cd_m2=100.0)
    scene = replace(picture.scene, lights=(), environment=environment)
    return replace(picture, scene=scene, library=library, environment=emitter)


PICTURES = {
    function.__name__: function
    for function in (
        cornell, metal, plastic, solid_glass, rough_glass, thin_glass, veil, coated, lamps,
        sun_and_spot, textured, environment_lit,
    )
}  # fmt: skip


def flip_of(reference: np.ndarray, image: np.ndarray) -> float:
    """Mean FLIP (Andersson et al. 2020) of two radiance images, exposed alike."""
    import flip_evaluator

    white = saturation_cd_m2(meter_ev100(reference.astype(np.float32)))
    shown = [
        display_values(light / white, "srgb").astype(np.float32) for light in (reference, image)
    ]
    return float(flip_evaluator.evaluate(shown[0], shown[1], "LDR")[1])


def worst_p(a: np.ndarray, b: np.ndarray) -> float:
    """Probability that equal means differ as much in some pixel as they do; images [n, h, w, 3].

    Pixels that vary little are compared as if both varied by a ten-thousandth of their light:
    float arithmetic differs by more than their noise.
    """
    n, m = len(a), len(b)
    floor = (1e-4 * b.mean(axis=0)) ** 2 + 1e-12
    va = a.var(axis=0, ddof=1) / n + floor
    vb = b.var(axis=0, ddof=1) / m + floor
    t = np.abs(a.mean(axis=0) - b.mean(axis=0)) / np.sqrt(va + vb)
    degrees = (va + vb) ** 2 / (va**2 / (n - 1) + vb**2 / (m - 1))
    p = 2.0 * stats.t.sf(t, degrees)
    return float(1.0 - (1.0 - p.min()) ** p.size)


def both(picture: Picture, samples: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    environment = picture.environment() if picture.environment else None
    loaded = mitsuba_scene(
        picture.scene, picture.camera, picture.library, picture.bsdfs, environment
    )
    theirs = mitsuba_images(loaded, samples, count)
    own = replicates_of(picture.scene, picture.camera, picture.library, samples, count)
    return own, theirs


@pytest.mark.slow
@pytest.mark.parametrize("name", PICTURES)
def test_converged_images_are_those_of_mitsuba(name: str) -> None:
    """At 1,024 samples: mean radiance within 1 %, FLIP below 0.05, no pixel off beyond chance."""
    pytest.importorskip("mitsuba")
    picture = PICTURES[name]()

    own, theirs = both(picture, 64, 16)

    reference, image = theirs.mean(axis=0), own.mean(axis=0)
    assert abs(image.mean() / reference.mean() - 1.0) < 0.01
    assert flip_of(reference, image) < 0.05
    if picture.exact:
        assert worst_p(own, theirs) > FAMILY_LEVEL


@pytest.mark.slow
def test_a_closed_box_looks_as_in_mitsuba() -> None:
    """Few samples: the same mean radiance to three standard errors, no pixel off beyond chance."""
    pytest.importorskip("mitsuba")

    own, theirs = both(cornell(), 16, 12)

    means = own.mean(axis=(1, 2, 3)), theirs.mean(axis=(1, 2, 3))
    error = math.sqrt(sum(m.var(ddof=1) / len(m) for m in means))
    assert error < 0.01 * means[1].mean()
    assert abs(means[0].mean() - means[1].mean()) < 3.0 * error
    assert worst_p(own, theirs) > FAMILY_LEVEL
