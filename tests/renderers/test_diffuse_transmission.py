"""Light through leaves, paper and cloth: closed forms, furnaces, and one tier against the other."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.assets.library import open_library
from gen_data.core.asset_types import Float32, Material, MeshData
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Camera, Environment, Instance, Light, Scene, Weather
from gen_data.core.se3 import SE3, Vec3
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.material_packing import body_materials
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers import images
from tests.renderers.fake_library import DARK, FakeLibrary, box_mesh, camera_at, plane_mesh
from tests.renderers.paths import ASKED, MET, radiance_of, replicates_of, settings_of

REFLECTED, PASSED = (0.3, 0.3, 0.3), (0.2, 0.4, 0.05)
LEAF = Material(REFLECTED, roughness=1.0, specular=0.0, diffuse_transmission=PASSED)
WHITE_SHEET = replace(LEAF, base_color=(0.7, 0.2, 0.5), diffuse_transmission=(0.3, 0.8, 0.5))
UNIFORM = Environment(luminance_cd_m2=100.0)


def sheet(material: Material = LEAF, normal: Vec3 = (0.0, 0.0, 1.0)) -> MeshData:
    """A level square of 4 m whose smooth normals may differ from its face's."""
    flat = plane_mesh(4.0, (material,))
    unit = np.array(normal) / np.linalg.norm(normal)
    return replace(flat, normals=np.tile(unit, (4, 1)).astype(np.float32))


def over(leaf: MeshData, *others: Body) -> tuple[Scene, FakeLibrary]:
    scene = Scene("t", (Body("leaf", "leaf"), *others), environment=DARK)
    return scene, FakeLibrary({"leaf": leaf, "box": box_mesh((6.0, 6.0, 0.1))})


def from_above() -> Camera:
    return camera_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (16, 12), hfov_deg=2.0)


def drawn(scene: Scene, library: FakeLibrary) -> Float32:
    return np.asarray(images.drawn(scene, from_above(), library).mean(axis=(0, 1)))


def sun_along(x: float, z: float) -> Light:
    return Light("sun", "sun", direction=(x, 0.0, z), illuminance_lux=1000.0)


@pytest.mark.slow
@pytest.mark.parametrize(("z", "albedo"), [(0.8, PASSED), (-0.8, REFLECTED)])
def test_the_sun_through_a_leaf_is_transmittance_times_lux_over_pi(z: float, albedo: Vec3) -> None:
    """A cosine of 0.8 leaves 800 lx of 1000, from below or from above, in both tiers."""
    scene, library = over(sheet())
    scene = replace(scene, lights=(sun_along(0.6, z),))

    expected = np.array(albedo) * 800.0 / math.pi

    np.testing.assert_allclose(drawn(scene, library), expected, rtol=1e-3)
    traced = radiance_of(scene, from_above(), library, 16)
    np.testing.assert_allclose(traced.mean(axis=(0, 1)), expected, rtol=1e-3)


@pytest.mark.parametrize("kind", ["sphere", "rectangle"])
def test_lamps_behind_a_leaf_agree_in_both_tiers(kind: str) -> None:
    """A lamp of 0.2 m, one metre below: the tiers agree to 2 %."""
    lamp = Light("lamp", "sphere", (0.3, 0.2, -1.0), intensity_cd=500.0, radius_m=0.1)
    if kind == "rectangle":
        lamp = Light("lamp", "rectangle", (0.3, 0.2, -1.0), direction=(0.0, 0.0, 1.0),
                     intensity_cd=500.0, size_m=(0.2, 0.2))  # fmt: skip
    scene, library = over(sheet())
    scene = replace(scene, lights=(lamp,))

    traced = radiance_of(scene, from_above(), library, 64).mean(axis=(0, 1))

    assert traced.min() > 1.0
    np.testing.assert_allclose(drawn(scene, library), traced, rtol=0.02)


def test_an_opaque_surface_stays_dark_with_the_sun_behind_it() -> None:
    """Transmittance is 0 by default."""
    scene, library = over(sheet(replace(LEAF, diffuse_transmission=(0.0, 0.0, 0.0))))
    scene = replace(scene, lights=(sun_along(0.6, 0.8),))

    assert drawn(scene, library).max() == 0.0


def test_a_body_before_the_lamp_shades_the_other_side() -> None:
    """A box below the leaf throws its shadow on it; a box above does not."""
    for z_m, lit in ((-0.5, False), (3.5, True)):
        scene, library = over(sheet(), Body("box", "box", SE3((0.0, 0.0, z_m))))
        scene = replace(scene, lights=(sun_along(0.0, 1.0),))
        traced = radiance_of(scene, from_above(), library, 4).max()

        assert (drawn(scene, library).max() > 1.0) == lit
        assert (traced > 1.0) == lit


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.9, 0.0, 0.5)])
def test_a_sheet_that_absorbs_nothing_disappears_in_a_furnace(normal: Vec3) -> None:
    """Reflectance and transmittance of 1 in all: 100 in, 100 out, for every smooth normal."""
    scene, library = over(sheet(WHITE_SHEET, normal))
    scene = replace(scene, environment=UNIFORM)

    traced = replicates_of(scene, from_above(), library, 64, 4)

    error = traced.std(axis=0).mean() / math.sqrt(traced.shape[1] * traced.shape[2])
    np.testing.assert_allclose(traced.mean(axis=(0, 1, 2)), 100.0, atol=4.0 * error + 0.1)
    if normal[0] == 0.0:
        np.testing.assert_allclose(drawn(scene, library), 100.0, rtol=5e-3)


def test_a_glossy_sheet_keeps_the_energy() -> None:
    """The specular layer takes its share of both lobes."""
    scene, library = over(sheet(replace(WHITE_SHEET, specular=0.5, roughness=0.4)))
    scene = replace(scene, environment=UNIFORM)

    np.testing.assert_allclose(drawn(scene, library), 100.0, rtol=5e-3)
    traced = replicates_of(scene, from_above(), library, 128, 4)
    np.testing.assert_allclose(traced.mean(axis=(0, 1, 2)), 100.0, rtol=5e-3)


def test_either_technique_alone_agrees_on_light_through_a_leaf() -> None:
    """Sampling of lamps and of directions estimate the same integral."""
    panel = Light("panel", "rectangle", (0.2, 0.0, -0.5), direction=(0.0, 0.0, 1.0),
                  intensity_cd=300.0, size_m=(1.0, 1.0))  # fmt: skip
    scene, library = over(sheet(replace(LEAF, specular=0.5), (0.5, 0.0, 0.8)))
    scene = replace(scene, lights=(panel,), environment=UNIFORM)

    asked, met = (
        replicates_of(scene, from_above(), library, 256, 4, lights=which).mean(axis=(0, 1, 2))
        for which in (ASKED, MET)
    )

    np.testing.assert_allclose(asked, met, rtol=0.01)


def test_a_sheet_never_scatters_more_than_it_receives() -> None:
    """A transmittance beyond the remainder of reflection is reduced, per channel."""
    scene, library = over(sheet(replace(LEAF, diffuse_transmission=(0.9, 0.5, 0.7))))
    (packed,) = body_materials(scene.bodies, DeviceCache(library, open_device("cpu")))

    passed = packed.surfaces["translucency"][0] * packed.surfaces["base_color"][0]
    np.testing.assert_allclose(passed, (0.7, 0.5, 0.7), rtol=1e-6)


@pytest.mark.slow
def test_snow_on_a_leaf_hides_the_light_below_it() -> None:
    """Snow transmits nothing here, whatever the albedo that it gives the surface."""
    scene, library = over(sheet())
    scene = replace(scene, lights=(sun_along(0.0, 1.0),))
    bare = drawn(scene, library)

    snowed = drawn(replace(scene, weather=Weather(snow_cover=1.0)), library)

    assert (snowed < 0.1 * bare).all()
    wet = drawn(replace(scene, weather=Weather(wetness=1.0)), library)
    assert (wet > 0.1 * bare).all()


@pytest.mark.slow
@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0, 180.0])
def test_a_crown_is_as_bright_as_in_the_path_tracer(azimuth_deg: float) -> None:
    """Mean luminance of an oak before, next to and after the sun, within 25 %."""
    from gen_data.randomizers.daylight import set_daylight
    from gen_data.sky.sky import SkyModel

    asset = "tree/oak?seed=0"
    library = open_library()
    low, high = library.bounds_m(asset)
    place = SE3((0.0, 0.0, -low[2]))
    scene = Scene(
        "t",
        (Body("tree", asset, place, instance_id=1),),
        instances=(Instance(1, "tree", "tree", 0, asset),),
    )
    scene = set_daylight(scene, SkyModel(0, 35.0, 2.5, 0.0, 0.18, "measured"), azimuth_deg)
    scene = replace(scene, environment=replace(scene.environment, visible=False))
    camera = camera_at((-30.0, 0.0, 1.6), (0.0, 0.0, 0.6 * (high[2] - low[2])), (64, 64), 24.0)

    means = []
    for settings in (RenderSettings(), settings_of(32, 12)):
        wanted = (Channel.RADIANCE, Channel.INSTANCE)
        channels = images.seen(scene, camera, library, *wanted, settings=settings)
        crown = channels[Channel.INSTANCE][:40] == 1
        means.append(channels[Channel.RADIANCE][:40][crown].mean(axis=0)[1])

    assert means[0] == pytest.approx(means[1], rel=0.25)
