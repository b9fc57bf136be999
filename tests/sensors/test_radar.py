"""Radar detections against the radar equation, kinematics and the statistics of data sheets."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core import asset_types, se3
from gen_data.core.scene import Body, Instance, Scene, Weather
from gen_data.sensors.device_presets import load_preset, preset_names
from gen_data.sensors.radar import radar_detection
from gen_data.sensors.radar.radar_sensor import PRESETS, Radar, RadarModel
from tests.sensors.streetcar import (
    PERSON_M,
    WALL_M,
    circle,
    moved,
    reading,
    straight,
    thing,
    track_of,
    world,
)

STILL = straight((0.0, 0.0), (0.0, 0.0))
AHEAD = {"offset_m": (2.2, 0.0, 0.5)}


def ideal(**fields: object) -> Radar:
    return Radar(**{"noise": 0.0, **AHEAD, **fields})  # type: ignore[arg-type]


def car_at(
    x_m: float, y_m: float = 0.0, yaw: float = 0.0, number: int = 2
) -> tuple[Body, Instance]:
    return thing(number, f"car/{number}", "car", se3.SE3.about_z(yaw, (x_m, y_m, 0.0)))


def detected_share(scene: Scene, readings: int, **fields: object) -> float:
    """How often instance 2 is detected at least once."""
    sensor = Radar(false_alarms=0.0, **AHEAD, **fields)  # type: ignore[arg-type]
    seen = [2 in reading(sensor, scene, 0, seed).rows["instance_id"] for seed in range(readings)]
    return float(np.mean(seen))


def test_radial_velocity_is_the_relative_velocity_along_the_ray() -> None:
    """10 m/s behind a car of 4 m/s that drives at 30 degrees to the left, 30 m ahead."""
    velocity = (4.0 * math.cos(0.5), 4.0 * math.sin(0.5))
    scene = world(
        others=[car_at(30.0, 4.0, 0.5)],
        tracks=[track_of("car/2", straight((30.0, 4.0), velocity, 0.5))],
    )
    rows = reading(ideal(), scene, 0).rows
    rows = rows[rows["instance_id"] == 2]
    along = np.stack([np.cos(rows["azimuth_rad"]), np.sin(rows["azimuth_rad"])])

    # Elevation is not measured: rays are up to two degrees from level, which is 6e-4 of 10 m/s.
    assert len(rows) > 0
    relative = np.array([velocity[0] - 10.0, velocity[1]])
    assert np.allclose(rows["velocity_m_s"], relative @ along, atol=0.02)
    assert np.allclose(rows["velocity_compensated_m_s"], np.array(velocity) @ along, atol=0.02)


def test_what_recedes_is_positive_and_what_has_no_track_stands() -> None:
    """A car that drives away from one that stands."""
    scene = world(
        STILL, others=[car_at(30.0)], tracks=[track_of("car/2", straight((30.0, 0.0), (7.0, 0.0)))]
    )
    rows = reading(ideal(), scene, 0).rows

    assert np.allclose(rows["velocity_m_s"], 7.0, atol=0.02)

    scene = world(STILL, others=[car_at(30.0)])
    still = replace(scene, tracks=())

    rows = reading(ideal(), still, 0).rows
    assert np.allclose(rows["velocity_m_s"], 0.0)


def test_turning_radar_sees_still_things_move_and_compensates_it() -> None:
    """On a circle of 20 m at 8 m/s; its lever arm of 2.2 m moves sideways."""
    scene = world(circle(20.0, 8.0), others=[car_at(15.0, 30.0)])
    rows = reading(ideal(), scene, 0).rows

    assert len(rows) > 0
    assert (rows["velocity_m_s"] < -6.0).all()
    assert np.allclose(rows["velocity_compensated_m_s"], 0.0, atol=0.03)


def test_ideal_ranges_and_angles_are_those_of_the_near_face() -> None:
    """A car's rear, 27.8 m away, 0.2 m to the left: nearest range, azimuths within its width."""
    rows = reading(ideal(model="imaging"), world(STILL, others=[car_at(32.2, 0.2)]), 0).rows
    rows = rows[rows["instance_id"] == 2]

    assert rows["range_m"].min() == pytest.approx(27.8, abs=0.05)
    assert (np.abs(np.tan(rows["azimuth_rad"]) * 27.8 - 0.2) < 0.95).all()
    height_m = 0.5 + np.sin(rows["elevation_rad"]) * rows["range_m"]
    assert (height_m > -0.05).all()
    assert (height_m < 1.55).all()


@pytest.mark.slow
def test_noise_of_range_azimuth_and_velocity_is_that_of_the_data_sheet() -> None:
    """Near scan: 0.1 m, 0.3 degrees ahead, 0.1 km/h; a post alone, which is one peak."""
    post = thing(2, "post", "car", se3.SE3((25.2, 0.0, 0.0)), ((-0.15, -0.15, 0), (0.15, 0.15, 1)))
    scene = world(STILL, others=[post])
    kept = [
        row
        for seed in range(250)
        for row in reading(Radar(false_alarms=0.0, **AHEAD), scene, 0, seed).rows
    ]
    rows = np.array(kept, dtype=kept[0].dtype)

    assert len(rows) > 150
    assert rows["range_m"].mean() == pytest.approx(22.86, abs=0.03)
    assert rows["range_m"].std() == pytest.approx(0.1, rel=0.15)
    assert np.degrees(rows["azimuth_rad"]).std() == pytest.approx(0.3, rel=0.15)
    assert rows["velocity_m_s"].std() == pytest.approx(0.028, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(("range_m", "expected"), [(125.0, 0.956), (200.0, 0.745), (250.0, 0.5)])
def test_detection_falls_with_the_fourth_power_of_range(range_m: float, expected: float) -> None:
    """10 dBsm at 250 m, by the radar equation: P = p^(1 / (1 + SNR)).

    SNR at 250 m is 18.9; 16 times as much at half of it, 2.44 times as much at 200 m.
    """
    snr = (math.log(1e6) / math.log(2.0) - 1.0) * (250.0 / range_m) ** 4
    assert expected == pytest.approx(1e-6 ** (1.0 / (1.0 + snr)), abs=2e-3)
    assert one_cell_share(range_m, 300) == pytest.approx(expected, abs=0.075)


def one_cell_share(range_m: float, readings: int) -> float:
    """How often a post of 10 dBsm is detected that lies in one cell of the far scan."""
    # Turned until its aspect has the mean cross section: cos(4 * 22.5 degrees) = 0.
    post = thing(
        2,
        "post",
        "car",
        se3.SE3.about_z(math.radians(22.5), (range_m + 2.2, -0.5, -1.0)),
        ((-0.45, -0.45, 0.0), (0.45, 0.45, 4.0)),
    )
    return detected_share(world(STILL, others=[post]), readings)


def test_pedestrians_are_lost_where_cars_are_not() -> None:
    """-8 dBsm against 10 dBsm at 100 m: 18 dB are the range to the power of 2.8."""
    person = thing(2, "person", "person", se3.SE3((100.0, 0.0, 0.0)), PERSON_M)

    assert detected_share(world(STILL, others=[car_at(100.0)]), 30) > 0.9
    assert detected_share(world(STILL, others=[person]), 60) < 0.75


def test_rain_takes_what_itu_says() -> None:
    """50 mm/h: 1.125 * 50^0.719 = 18.7 dB/km, 9.4 dB over 250 m and back."""
    sensor = Radar(noise=1.0, false_alarms=0.0, **AHEAD)  # type: ignore[arg-type]
    dry = world(STILL, others=[car_at(60.0)])
    wet = moved(dry, weather=Weather(rain_mm_h=50.0))
    pairs = [
        (reading(sensor, dry, 0, seed).rows, reading(sensor, wet, 0, seed).rows)
        for seed in range(20)
    ]
    losses = [float(a["snr_db"].max() - b["snr_db"].max()) for a, b in pairs if len(a) and len(b)]

    expected = 2.0 * 0.0556 * 1.125 * 50.0**0.719
    assert np.median(losses) == pytest.approx(expected, abs=0.15)


def test_a_car_behind_a_wall_gives_no_detection() -> None:
    wall = thing(3, "wall", "building", se3.SE3((20.0, 0.0, 0.0)), WALL_M)
    scene = world(STILL, others=[car_at(35.0), wall])
    for seed in range(10):
        ids = reading(Radar(false_alarms=0.0, **AHEAD), scene, 0, seed).rows["instance_id"]
        assert 2 not in ids
        assert 3 in ids


def test_half_hidden_target_has_half_the_cross_section() -> None:
    """A wall before one half of a car's rear: half of the box is in sight.

    A car is taken to fill 0.85 of its box; these boxes are full: half is 0.5 / 0.85.
    """
    rear = ((-0.05, -1.25, 0.2), (0.05, 1.25, 3.2))
    car = thing(2, "car", "car", se3.SE3((40.0, 0.0, 0.0)), rear)
    cover = thing(3, "cover", "building", se3.SE3((30.0, 5.0, 0.0)), ((-0.1, -5, 0), (0.1, 5, 5)))

    def total(*others: object) -> float:
        """Mean over shifts of the grid of rays."""
        scene = world(STILL, others=others)  # type: ignore[arg-type]
        found = np.concatenate([reading(ideal(), scene, 0, seed).rows for seed in range(20)])
        mine = found[found["instance_id"] == 2]
        return float(np.sum(10.0 ** (0.1 * mine["rcs_dbsm"]))) / 20.0

    assert 10.0 * math.log10(total(car) / total(car, cover)) == pytest.approx(
        10.0 * math.log10(0.85 / 0.5), abs=0.3
    )


def test_cross_section_of_a_whole_car_is_its_own_at_any_range() -> None:
    """15 dBsm from behind (10 and the 5 of its flat side) whether 20 or 60 m away."""
    for x_m in (24.0, 44.0, 64.0):
        rows = reading(ideal(), world(STILL, others=[car_at(x_m)]), 0).rows
        total = np.sum(10.0 ** (0.1 * rows["rcs_dbsm"]))
        assert 10.0 * math.log10(total) == pytest.approx(15.0, abs=1.0)


def test_cross_sections_follow_the_aspect_and_silhouettes_the_faces() -> None:
    """5 dB more square on, 5 dB less across the corner."""
    _, car = car_at(0.0)
    sides = {0.0: 15.0, 22.5: 10.0, 45.0: 5.0, 90.0: 15.0, 180.0: 15.0}
    for degrees, dbsm in sides.items():
        angle = math.radians(degrees)
        towards = np.array([math.cos(angle), math.sin(angle), 0.0])
        found = radar_detection.cross_section_m2(radar_detection.TARGETS["car"], car, towards)
        assert 10.0 * math.log10(found) == pytest.approx(dbsm, abs=1e-6)

    half = math.sqrt(0.5)

    assert radar_detection.silhouette_m2(car, np.array([1.0, 0.0, 0.0])) == pytest.approx(2.7)
    expected = half * (1.8 * 1.5 + 4.4 * 1.5)
    assert radar_detection.silhouette_m2(car, np.array([half, half, 0.0])) == pytest.approx(
        expected
    )


def test_false_alarms_come_at_the_given_rate_and_belong_to_nothing() -> None:
    """Mean of Poisson: 4 a reading, over the whole field of view."""
    sensor = Radar(false_alarms=4.0, **AHEAD)  # type: ignore[arg-type]
    found = [reading(sensor, world(STILL), 0, seed).rows for seed in range(150)]
    rows = np.concatenate(found)

    assert len(rows) / len(found) == pytest.approx(4.0, abs=0.6)
    assert (rows["origin"] == 0).all()
    assert (rows["instance_id"] == 0).all()
    assert rows["range_m"].max() > 200.0
    assert np.degrees(np.abs(rows["azimuth_rad"])).max() > 45.0


def test_neither_its_carrier_nor_what_is_outside_its_field_is_seen() -> None:
    """Behind it, aside of it, and at 260 m."""
    for pose in ((-30.0, 0.0), (0.0, 30.0), (270.0, 0.0)):
        assert len(reading(ideal(), world(STILL, others=[car_at(*pose)]), 0).rows) == 0
    sensor = Radar(noise=0.0, offset_m=(0.0, 0.0, 0.5))

    assert len(reading(sensor, world(STILL), 0).rows) == 0


def test_strongest_are_kept_and_the_nearest_comes_first() -> None:
    """A crowd of more cells than the device reports."""
    many = [
        thing(k + 2, f"wall/{k}", "building", se3.SE3((8.0 + 2.0 * k, -40.0 + k, 0.0)), WALL_M)
        for k in range(60)
    ]
    rows = reading(ideal(), world(STILL, others=many), 0).rows

    assert len(rows) <= 250
    assert (np.diff(rows["range_m"]) >= 0.0).all()


@pytest.mark.parametrize("name", preset_names(PRESETS))
def test_every_make_is_complete(name: str) -> None:
    """Its looks cover their field, and reach where they report."""
    make = load_preset(PRESETS, name, RadarModel)
    for look in make.looks:
        assert 0.0 < look.range_m[0] < look.range_m[1] <= max(r for _, r in look.reach_m)
        assert look.spacing_deg[0] < min(size for _, size in look.resolution.azimuth_deg)


def test_every_surface_sends_back_what_its_kind_does() -> None:
    """Whatever a ray may hit has a value; metal posts count by their kind."""
    every = np.arange(len(asset_types.SURFACES), dtype=np.uint8)
    factors = radar_detection.area_factor("building", every)

    assert (factors > 0.0).all()
    assert factors[asset_types.SURFACES.index("asphalt")] == pytest.approx(10.0**-2.8)
    assert (radar_detection.area_factor("barrier", every) == 1.0).all()
