"""Weather in images, against closed forms; and its absence elsewhere."""

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
import warp as wp

from gen_data.core import asset_types, intrinsics, motion
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import (
    Body,
    Camera,
    Environment,
    Instance,
    LaneKind,
    Light,
    ObjectGroup,
    Scene,
    Weather,
)
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.atmosphere.precipitation import (
    light_level_ev100,
    make_streaks,
    poisson,
    rain,
    snow,
    usual_exposure_s,
)
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.realtime.light_selection import main_lamps
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene import device_cache, scene_packing
from gen_data.renderers.warp.settings import RenderSettings
from tests.randomizers.doubles import rng_of
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh

pytestmark = pytest.mark.slow

RADIANCE = frozenset({Channel.RADIANCE})
SEEN = frozenset({Channel.RADIANCE, Channel.RANGE, Channel.INSTANCE})
LENS = intrinsics.Intrinsics(96, 64, 80.0, 80.0, 48.0, 32.0)
FINE = intrinsics.Intrinsics(288, 192, 240.0, 240.0, 144.0, 96.0)
AHEAD = Camera("front", look_at((0.0, 0.0, 1.5), (10.0, 0.0, 1.2)), LENS)
DOWN = Camera("top", look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0)), LENS)
PLAIN = RenderSettings(ambient_occlusion_radius_m=0.0, antialias=1)
ASPHALT = (asset_types.Material(base_color=(0.3, 0.3, 0.3), roughness=0.95, specular=0.0),)
BLACK = (asset_types.Material(base_color=(0.0, 0.0, 0.0), roughness=1.0, specular=0.0),)
SUN = Light("sun", "sun", direction=(0.8, 0.0, -0.6), illuminance_lux=1500.0)
DARK = Environment(luminance_cd_m2=0.0)
LANES: tuple[LaneKind, LaneKind] = ("parking", "driving")
STORM = Weather(0.02, 20.0, 30.0, 2.0, 0.9, 0.4, 0.4, 0.05, seed=5)


@pytest.fixture(scope="module")
def library() -> FakeLibrary:
    return FakeLibrary(
        {
            "road": plane_mesh(60.0, ASPHALT),
            "black": box_mesh((0.2, 60.0, 60.0), BLACK),
            "lid": box_mesh((0.8, 0.8, 0.05), ASPHALT),
            "box": box_mesh((1.0, 1.0, 1.0), ASPHALT),
        }
    )


@pytest.fixture(scope="module")
def renderer(library: FakeLibrary) -> WarpRenderer:
    return WarpRenderer(library, "cpu", PLAIN)


def street(weather: Weather, environment: Environment = DARK, *lights: Light) -> Scene:
    bodies = (
        Body("road", "road"), Body("wall", "black", SE3((25.0, 0.0, 0.0)), instance_id=1),
        Body("box", "box", SE3((6.0, 0.5, 0.5)), instance_id=2),
    )  # fmt: skip
    named = tuple(Instance(k, name, name, k, name) for k, name in ((1, "wall"), (2, "box")))
    return Scene("t", bodies, named, lights=lights, environment=environment, weather=weather)


def flat(weather: Weather, *bodies: Body) -> Scene:
    return Scene("t", (Body("road", "road"), *bodies), lights=(SUN,), environment=DARK,
                 weather=weather)  # fmt: skip


def luminance(reading: SensorReading) -> np.ndarray:
    return reading.channels[Channel.RADIANCE][..., 1].astype(float)


def test_no_weather_changes_no_byte(renderer: WarpRenderer) -> None:
    """A seed alone, or a fog height without fog, does not count as weather."""
    light = (Environment(luminance_cd_m2=60.0), SUN)
    plain = renderer.render(street(Weather(), *light), AHEAD, RADIANCE).channels[Channel.RADIANCE]
    empty = Weather(seed=99, fog_height_m=50.0)
    seeded = renderer.render(street(empty, *light), AHEAD, RADIANCE).channels[Channel.RADIANCE]

    assert plain.tobytes() == seeded.tobytes()


@pytest.mark.slow
def test_labels_do_not_see_the_weather(renderer: WarpRenderer) -> None:
    channels = frozenset(Channel)
    light = (Environment(luminance_cd_m2=60.0), SUN)
    clear = renderer.render(street(Weather(), *light), AHEAD, channels)
    stormy = renderer.render(street(STORM, *light), AHEAD, channels)

    for channel in sorted(channels & clear.channels.keys(), key=lambda c: c.value):
        same = clear.channels[channel].tobytes() == stormy.channels[channel].tobytes()
        assert same != (channel is Channel.RADIANCE), channel
    assert clear.silhouettes.keys() == stormy.silhouettes.keys() == {1, 2}
    for key, silhouette in clear.silhouettes.items():
        assert np.array_equal(silhouette.mask, stormy.silhouettes[key].mask)


def test_same_weather_makes_the_same_bytes_in_another_renderer(library: FakeLibrary) -> None:
    """Another seed gives other streaks, patches and drops."""
    light = (Environment(luminance_cd_m2=60.0), SUN)
    first, again, other = (
        WarpRenderer(library, "cpu", PLAIN)
        .render(street(weather, *light), AHEAD, RADIANCE)
        .channels[Channel.RADIANCE]
        .tobytes()
        for weather in (STORM, STORM, replace(STORM, seed=6))
    )

    assert first == again
    assert first != other


def test_even_fog_follows_beer_and_lambert(renderer: WarpRenderer) -> None:
    """In front of black, fog has the radiance L (1 - exp(-beta r)) in uniform light L."""
    beta, sky = 0.05, 200.0
    scene = street(Weather(fog_extinction_per_m=beta), Environment(luminance_cd_m2=sky))
    reading = renderer.render(scene, AHEAD, SEEN)
    wall = reading.channels[Channel.INSTANCE] == 1
    expected = sky * (1.0 - np.exp(-beta * reading.channels[Channel.RANGE][wall].astype(float)))

    assert wall.sum() > 500
    assert np.abs(luminance(reading)[wall] / expected - 1.0).max() < 0.02


def test_fog_thins_with_height(renderer: WarpRenderer) -> None:
    """The optical depth of a sloping ray: beta H exp(-z / H) (1 - exp(-d_z r / H)) / d_z."""
    beta, height, sky = 0.2, 4.0, 200.0
    weather = Weather(fog_extinction_per_m=beta, fog_height_m=height)
    scene = street(weather, Environment(luminance_cd_m2=sky))
    reading = renderer.render(scene, AHEAD, SEEN)
    rows, columns = np.nonzero(reading.channels[Channel.INSTANCE] == 1)
    r = reading.channels[Channel.RANGE][rows, columns].astype(float)
    v = np.stack([(columns + 0.5 - 48.0) / 80.0, (rows + 0.5 - 32.0) / 80.0, np.ones_like(r)])
    v = v / np.linalg.norm(v, axis=0)
    up = (AHEAD.T_world_camera.rotation() @ v)[2]
    depth = beta * height * math.exp(-1.5 / height) * -np.expm1(-up * r / height) / up
    expected = sky * -np.expm1(-depth)

    assert np.abs(luminance(reading)[rows, columns] / expected - 1.0).max() < 0.02


def test_lamp_in_fog_has_a_halo(renderer: WarpRenderer) -> None:
    """In front of the black wall light surrounds the lamp, decreasing with distance."""
    lamp = Light("lamp", "sphere", position_m=(10.0, 0.0, 1.2), intensity_cd=4000.0)
    foggy = renderer.render(street(Weather(fog_extinction_per_m=0.05), DARK, lamp), AHEAD, RADIANCE)
    row = luminance(foggy)[32, 48:]

    assert row[1] > row[8] > row[20] > 0.0


def test_soaked_asphalt_keeps_a_fifth_of_its_albedo(renderer: WarpRenderer) -> None:
    """Lagarde 2013: a porous surface is darkened by lerp(1, 0.2, wetness)."""
    half = (slice(24, 40), slice(36, 60))
    dry = luminance(renderer.render(flat(Weather()), DOWN, RADIANCE))[half].mean()
    for wetness in (0.5, 1.0):
        soaked = renderer.render(flat(Weather(wetness=wetness)), DOWN, RADIANCE)
        wet = luminance(soaked)[half].mean()
        # Half of the pixel is a film of water with a reflectance of 2 %, in a dark room.
        film = 1.0 - 0.5 * wetness * 0.02
        assert wet / dry == pytest.approx((1.0 - 0.8 * wetness) * film, rel=0.03)


def test_nothing_falls_below_a_lid(renderer: WarpRenderer) -> None:
    """Below a low roof the road stays unchanged."""
    side = Camera("side", look_at((0.0, -4.0, 0.6), (0.0, 0.0, 0.0)), FINE)
    lid = Body("lid", "lid", SE3((0.0, 0.0, 1.4)))
    under = Environment(luminance_cd_m2=100.0)
    dry, snowy = (
        luminance(renderer.render(replace(flat(w, lid), environment=under), side, RADIANCE))
        for w in (Weather(), Weather(snow_cover=1.0))
    )

    assert snowy[96, 143:145] == pytest.approx(dry[96, 143:145], rel=0.05)
    assert snowy[180].mean() > 2.0 * dry[180].mean()


@pytest.mark.parametrize("tier", ["realtime", "pathtraced"])
@pytest.mark.parametrize("mover", ["drives", "walks", "has a trajectory"])
def test_what_moves_keeps_no_ground_dry(
    library: FakeLibrary, mover: str, tier: Literal["realtime", "pathtraced"]
) -> None:
    """Below a moving lid the sunlit road is as wet as open ground, below a parked one dry."""
    side = Camera("side", look_at((0.0, -1.2, 1.0), (0.0, 0.0, 0.0)), LENS)
    settings = PLAIN.model_copy(update={"tier": tier, "samples": 16})
    renderer = WarpRenderer(library, "cpu", settings)
    lid = Body("lid", "lid", SE3((0.0, 0.0, 1.4)), instance_id=1, group="cars")

    def road(wetness: float, group: ObjectGroup, **changed: Any) -> float:
        scene = replace(
            flat(Weather(wetness=wetness), lid), groups=(group,),
            instances=(Instance(1, "lid", "lid", 1, "lid"),),
        )  # fmt: skip
        image = luminance(renderer.render(replace(scene, **changed), side, RADIANCE))
        return float(image[31:33, 47:49].mean())

    parked, driving = (
        ObjectGroup("cars", (), ("lid",), 1, "along", lanes=(kind,)) for kind in LANES
    )
    walker = Instance(1, "p", "person", 1, "lid", attributes=(("behaviour", "walking"),))
    moving: dict[str, dict[str, Any]] = {
        "drives": {"group": driving}, "walks": {"group": parked, "instances": (walker,)},
        "has a trajectory": {
            "group": parked,
            "tracks": (motion.Trajectory("lid", 0.1, (lid.T_world_body, SE3((0.1, 0.0, 1.4)))),),
        },
    }  # fmt: skip
    dry, sheltered, wet = road(0.0, parked), road(1.0, parked), road(1.0, **moving[mover])

    assert sheltered == pytest.approx(dry, rel=0.03)
    # As on open ground above; at 40 degrees the film reflects 3 %.
    assert wet / dry == pytest.approx(0.2 * (1.0 - 0.5 * 0.03), rel=0.03)


@pytest.mark.parametrize("cover", [0.25, 0.75])
def test_snow_covers_its_share_of_the_ground(renderer: WarpRenderer, cover: float) -> None:
    """Over many square metres, and as white as snow: an albedo of 0.8 to 0.9."""
    high = Camera("high", look_at((0.0, 0.0, 30.0), (0.0, 0.0, 0.0)), FINE)
    image = luminance(renderer.render(flat(Weather(snow_cover=cover, seed=3)), high, RADIANCE))
    white = 0.83 * 900.0 / math.pi

    assert (image > 0.5 * white).mean() == pytest.approx(cover, abs=0.08)
    assert np.quantile(image, 0.99) == pytest.approx(white, rel=0.08)


def flooded_share(renderer: WarpRenderer, puddles: float, road: Body) -> float:
    """Share of level ground under water, seen from above: wet asphalt is darker."""
    high = Camera("high", look_at((0.0, 0.0, 80.0), (0.0, 0.0, 0.0)), FINE)
    shares = []
    for seed in range(4):
        scene = flat(Weather(puddles=puddles, seed=seed)).with_bodies(road)
        image = luminance(renderer.render(scene, high, RADIANCE))
        inside = image[48:144, 96:192]
        shares.append(float((inside < 0.6 * inside.max()).mean()))
    return float(np.mean(shares))


def test_water_stands_in_gutters_less_on_crowns_and_seldom_on_soil(renderer: WarpRenderer) -> None:
    """Level asphalt at z = 0 has the stated share, a crown of 6 cm at most half of it."""
    soil = (replace(ASPHALT[0], role="grass"),)
    gutter, crown, turf = (
        flooded_share(renderer, 0.3, body)
        for body in (
            Body("road", "road"),
            Body("road", "road", SE3((0.0, 0.0, 0.06))),
            Body("road", "road", materials=soil),
        )
    )

    assert gutter == pytest.approx(0.3, abs=0.08)
    assert 0.03 < crown < 0.5 * gutter
    assert turf < 0.25 * gutter


def test_puddles_mirror_what_stands_behind_them(renderer: WarpRenderer) -> None:
    """The whole road under water: a lit wall appears in it with Fresnel's reflectance."""
    glow = (asset_types.Material(base_color=(0.0, 0.0, 0.0), roughness=1.0, specular=0.0,
                     emission_cd_m2=(200.0, 200.0, 200.0)),)  # fmt: skip
    scene = street(Weather(puddles=1.0))
    wall = replace(scene.body("wall"), materials=glow)
    reading = renderer.render(scene.with_bodies(wall), AHEAD, RADIANCE)
    row, column = 58, 80
    d = AHEAD.T_world_camera.rotation() @ [(column - 47.5) / 80.0, (row - 31.5) / 80.0, 1.0]
    cosine = -d[2] / np.linalg.norm(d)
    fresnel = 0.02 + 0.98 * (1.0 - cosine) ** 5

    assert luminance(reading)[row, column] == pytest.approx(200.0 * fresnel, rel=0.06)


def test_streaks_are_a_poisson_process() -> None:
    """Their number has equal mean and variance; they spread evenly over the image."""
    kind = rain(1.0)
    found = [make_streaks(kind, AHEAD, Weather(seed=k), 0.004, "rain") for k in range(300)]
    numbers = np.array([len(values) for values in found])
    frustum_m3 = (96 / 80) * (64 / 80) / 3.0 * (6.0**3 - 0.35**3)
    expected = 8000.0 / 4.1 * math.exp(-4.1) * frustum_m3
    middle = np.concatenate([(v["start_px"] + v["end_px"])[:, 0] / 2 for v in found])

    assert numbers.mean() == pytest.approx(expected, rel=0.02)
    assert numbers.var() / numbers.mean() == pytest.approx(1.0, abs=0.25)
    quarters = np.histogram(middle, bins=4, range=(0.0, 96.0))[0]
    assert quarters / quarters.mean() == pytest.approx(np.ones(4), abs=0.03)


def test_small_poisson_numbers_have_the_right_mean_and_variance() -> None:
    """Below the limit where the normal approximation takes over."""
    rng = rng_of("poisson")
    numbers = np.array([poisson(3.0, rng) for _ in range(4000)])

    assert numbers.mean() == pytest.approx(3.0, abs=0.1)
    assert numbers.var() == pytest.approx(3.0, abs=0.25)


def test_drops_fall_faster_than_flakes() -> None:
    """Streaks of rain are several times longer than streaks of flakes."""
    streaks = make_streaks(rain(10.0), AHEAD, Weather(seed=1), 0.01, "rain")
    flakes = make_streaks(snow(1.0), AHEAD, Weather(seed=1), 0.01, "snow")
    lengths = [
        float(np.median(np.hypot(*(v["end_px"] - v["start_px"]).T) * v["z_m"]))
        for v in (streaks, flakes)
    ]

    assert lengths[0] > 2.0 * lengths[1]
    # A drop of 1.4 mm falls at about 5.2 m/s (Gunn and Kinzer 1949): 52 mm in 10 ms, at 80 px.
    assert lengths[0] / 80.0 == pytest.approx(0.052, rel=0.2)


def test_nearer_things_hide_what_falls_behind_them(renderer: WarpRenderer) -> None:
    """Few streaks in front of a wall half a metre away, many on the open road."""
    weather = Weather(snow_mm_h=3.0, seed=2)
    light = Environment(luminance_cd_m2=100.0)
    changed = []
    for x in (0.55, 25.0):
        pictures = []
        for w in (Weather(), weather):
            scene = street(w, light)
            wall = replace(scene.body("wall"), T_world_body=SE3((x + 0.1, 0.0, 0.0)))
            pictures.append(luminance(renderer.render(scene.with_bodies(wall), AHEAD, RADIANCE)))
        changed.append(float((np.abs(pictures[1] - pictures[0]) > 0.5).mean()))

    assert changed[1] > 0.02
    assert changed[0] < 0.1 * changed[1]


def test_exposure_time_follows_the_light() -> None:
    """T = N^2 / 2^EV at f/2, held between 1/500 s and 1/40 s."""
    assert usual_exposure_s(9.0) == pytest.approx(4.0 / 512.0)
    assert usual_exposure_s(15.0) == pytest.approx(1.0 / 500.0)
    assert usual_exposure_s(0.0) == pytest.approx(1.0 / 40.0)


def test_streaks_without_an_exposure_time_follow_the_median_luminance() -> None:
    """Middle grey at 0.18 of saturation, 1.2 * 2^EV; a fixed EV takes precedence; black is ignored.

    Whatever part of the picture is far brighter: 0.216 * 2^6 cd/m^2 is EV 6.
    """
    level = np.full((900, 3), 0.216 * 2.0**6, np.float32)
    level[:200] = 1e5
    level[200:600] = 0.0
    level[600:] = 0.216 * 2.0**6
    radiance = wp.array(np.roll(level, 37, axis=0), dtype=wp.vec3, device="cpu")

    assert light_level_ev100(radiance, None) == pytest.approx(6.0, abs=0.05)
    assert light_level_ev100(radiance, 11.0) == 11.0
    black = wp.zeros(900, dtype=wp.vec3, device="cpu")
    assert usual_exposure_s(light_level_ev100(black, None)) == pytest.approx(1.0 / 40.0)


def test_lamps_that_light_the_view_are_kept(library: FakeLibrary) -> None:
    """Of a row of lamps the nearest remain, in order, and the sun always."""
    lamps = tuple(
        Light(f"{k}", "spot", (5.0 * k, 0.0, 6.0), intensity_cd=2000.0, cone_rad=1.2)
        for k in range(40)
    )
    scene = street(Weather(), DARK, *lamps, SUN)
    cache = device_cache.DeviceCache(library, open_device("cpu"))
    records = scene_packing.pack_world(scene, AHEAD, cache).record.lamps.numpy()
    ground = np.stack([np.linspace(1.0, 20.0, 60), np.zeros(60), np.zeros(60)], axis=-1)
    up = np.tile([0.0, 0.0, 1.0], (60, 1))

    assert main_lamps(records, ground, up, 6).tolist() == [0, 1, 2, 3, 4, 40]


def test_lamps_left_out_change_little(library: FakeLibrary) -> None:
    """Sixteen of forty lamps reproduce the image of all of them, within 2 % of its light."""
    lamps = tuple(
        Light(f"{k}", "spot", (4.0 * k - 20.0, 0.0, 6.0), intensity_cd=2000.0, cone_rad=1.2)
        for k in range(40)
    )
    scene = street(Weather(), DARK, *lamps)
    few, every = (
        luminance(WarpRenderer(library, "cpu", PLAIN.model_copy(update={"max_lamps": n})).render(
            scene, AHEAD, RADIANCE))
        for n in (16, 40)
    )  # fmt: skip

    assert few.sum() == pytest.approx(every.sum(), rel=0.02)
