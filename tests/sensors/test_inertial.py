"""Inertial units, satellite receivers and odometers against analytic motion."""

import math

import numpy as np
import pytest
from scipy.special import fresnel

from gen_data.core.errors import ConfigError
from gen_data.core.geodesy import GeodeticOrigin, ecef_to_geodetic, geodetic_to_ecef, to_geodetic
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.sensors.navigation.gnss import Gnss
from gen_data.sensors.navigation.imu import Imu
from gen_data.sensors.navigation.odometer import Odometer
from tests.sensors.streetcar import WALL_M, circle, reading, readings, straight, thing, world

GRAVITY = 9.80665


def forces(rows: np.ndarray) -> np.ndarray:
    return np.stack([rows[f"force_{axis}_m_s2"] for axis in "xyz"], axis=1)


def rates(rows: np.ndarray) -> np.ndarray:
    return np.stack([rows[f"rate_{axis}_rad_s"] for axis in "xyz"], axis=1)


def still(seconds: float = 4.0) -> Scene:
    return world(straight((0.0, 0.0), (0.0, 0.0)), seconds=seconds)


def test_device_at_rest_feels_gravity_alone() -> None:
    """Upwards, in its own axes: pitched up by 30 degrees, half of it is forward."""
    rows = readings(Imu(noise=0, pitch_deg=30), still(), 3)

    expected = [GRAVITY * 0.5, 0.0, GRAVITY * math.cos(math.radians(30))]
    assert np.allclose(forces(rows), expected, atol=1e-6)
    assert np.allclose(rates(rows), 0.0, atol=1e-9)


@pytest.mark.parametrize("ahead_m", [0.0, 1.5])
def test_circular_motion_is_felt_as_its_centripetal_acceleration(ahead_m: float) -> None:
    """20 m, 8 m/s: v^2 / r to the left, v / r about the upward axis; ahead, omega^2 r backwards."""
    rows = readings(Imu(noise=0, offset_m=(ahead_m, 0.0, 0.0)), world(circle(20.0, 8.0)), 10)

    assert np.allclose(forces(rows), [-(0.4**2) * ahead_m, 3.2, GRAVITY], atol=5e-3)
    assert np.allclose(rates(rows), [0.0, 0.0, 0.4], atol=1e-4)


def test_a_growing_turn_is_felt_from_the_first_to_the_last_reading() -> None:
    """10 m/s on a clothoid: turn rate 0.2 t and v times that to the left, at both ends too."""
    unit_s = math.sqrt(math.pi / 0.2)

    def clothoid(t: float) -> SE3:
        sine, cosine = fresnel(t / unit_s)
        return SE3.about_z(0.1 * t * t, (10.0 * unit_s * cosine, 10.0 * unit_s * sine, 0.0))

    rows = readings(Imu(noise=0, rate_hz=10), world(clothoid, seconds=1.0), 11)
    rate = 0.2 * rows["time_s"]

    assert rows["time_s"][[0, -1]] == pytest.approx([0.0, 1.0])
    assert np.allclose(rates(rows)[:, 2], rate, atol=2e-3)
    assert np.allclose(forces(rows)[:, 1], 10.0 * rate, atol=1e-2)


def test_readings_follow_each_other_evenly_over_steps() -> None:
    """One at time 0, then ten in every step of 0.1 s; none twice, none missing."""
    rows = readings(Imu(rate_hz=100), world(), 4)

    assert np.allclose(rows["time_s"], np.arange(31) / 100.0, atol=1e-12)


@pytest.mark.slow
def test_bias_walks_on_from_step_to_step() -> None:
    """Steps made alone share one walk: its changes grow with time as a walk's do."""
    sensor = Imu(model="ADIS16448", rate_hz=10)
    walks = np.stack([rates(readings(sensor, still(20.0), 101, seed))[:, 0] for seed in range(60)])
    biases = walks.mean(axis=1)

    assert abs(biases.std() / 8.7e-3 - 1.0) < 0.35
    # Differences of neighbours hold twice the white noise, and one step of the walk.
    white = 1.6968e-4 * math.sqrt(10.0)
    step = 1.9393e-5 / math.sqrt(10.0)
    assert abs(np.diff(walks, axis=1).std() / math.hypot(math.sqrt(2) * white, step) - 1) < 0.05


def test_walk_grows_with_the_root_of_time() -> None:
    """A unit whose only error is a walk: after 100 readings it is ten times the first."""
    scene, sensor = still(20.0), Imu(model="ADIS16448", rate_hz=10)

    def force(step: int, seed: int) -> float:
        return float(forces(reading(sensor, scene, step, seed).rows)[0, 0])

    ends = np.array([force(100, seed) - force(0, seed) for seed in range(400)])
    white, walk = 2.0e-3 * math.sqrt(10.0), 3.0e-3 / math.sqrt(10.0)
    assert abs(ends.std() / math.hypot(math.sqrt(2) * white, 10.0 * walk) - 1.0) < 0.1


def test_white_noise_has_the_density_of_the_data_sheet() -> None:
    """0.2 degrees per root hour at 100 Hz: 5.8e-4 rad/s; 0.005 m/s per root hour: 8.3e-4 m/s^2."""
    rows = readings(Imu(model="RT3003"), still(), 40)

    gyro = math.radians(0.2) / 60.0 * 10.0
    accelerometer = 0.005 / 60.0 * 10.0
    assert abs(np.diff(rates(rows), axis=0).std() / (gyro * math.sqrt(2)) - 1.0) < 0.05
    assert abs(np.diff(forces(rows), axis=0).std() / (accelerometer * math.sqrt(2)) - 1.0) < 0.05


@pytest.mark.parametrize(("fields", "words"), [
    ({"rate_hz": 33.0}, "rate_hz 33 does not fit step_s 0.1"),
    ({"rig": "egg"}, "the scene has no rig 'egg'; its rigs: ego"),
])  # fmt: skip
def test_what_does_not_fit_the_scene_is_told(fields: dict, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Imu(**fields).mount(world())


def test_geodetic_coordinates_of_known_places() -> None:
    """Equator, pole and 45 degrees, from the ellipsoid's published axes."""
    places = np.array([[0.0, 0.0, 0.0], [0.0, 90.0, 10.0], [90.0, 0.0, 5.0], [45.0, -90.0, 0.0]])
    # The last: N = a / sqrt(1 - e^2 / 2) = 6388838.290 m; x = N cos 45, z = (1 - e^2) N sin 45.
    centred = np.array([[6378137.0, 0.0, 0.0], [0.0, 6378147.0, 0.0], [0.0, 0.0, 6356757.314245],
                        [0.0, -4517590.878849, 4487348.408866]])  # fmt: skip

    assert np.allclose(geodetic_to_ecef(places), centred, atol=1e-4)
    back = ecef_to_geodetic(centred)
    assert np.allclose(back[:, [0, 2]], places[:, [0, 2]], atol=1e-6)
    assert np.allclose(back[[0, 1, 3], 1], places[[0, 1, 3], 1], atol=1e-9)


def test_a_kilometre_north_and_east_is_the_published_share_of_a_degree() -> None:
    """At 49 degrees, one of latitude is 111.2095 km, one of longitude 73.1727 km (WGS 84)."""
    ends = to_geodetic(1000.0 * np.eye(3)[:2], GeodeticOrigin(49.0, 8.0))

    assert ends[1, 0] - 49.0 == pytest.approx(1000.0 / 111_209.5, rel=3e-5)
    assert ends[0, 1] - 8.0 == pytest.approx(1000.0 / 73_172.7, rel=3e-5)


def moved_m(row: np.void, origin: GeodeticOrigin) -> np.ndarray:
    """From the origin to a fix, east, north and up, through coordinates at the Earth's centre."""
    fix = [row["latitude_deg"], row["longitude_deg"], row["altitude_m"]]
    start = [origin.latitude_deg, origin.longitude_deg, origin.altitude_m]
    ends = geodetic_to_ecef(np.array([start, fix]))
    return np.asarray(origin.axes().T @ (ends[1] - ends[0]))


def test_ideal_receiver_tells_where_the_antenna_is() -> None:
    """Within a tenth of a millimetre, and its velocity."""
    sensor = Gnss(noise=0, offset_m=(0.5, 0.0, 1.6), origin_deg=(49.0, 8.0), origin_altitude_m=100)
    row = reading(sensor, world(), 5).rows[0]

    assert np.allclose(moved_m(row, GeodeticOrigin(49.0, 8.0, 100.0)), [5.5, 0.0, 1.6], atol=1e-4)
    assert row["velocity_east_m_s"] == pytest.approx(10.0, abs=1e-4)
    assert (row["quality"], row["satellites"]) == (1, 12)


def test_receiver_errs_as_its_data_sheet_says() -> None:
    """2.5 m CEP: half of the fixes of many sequences are within 2.5 m."""
    scene, origin = still(), GeodeticOrigin(49.0114, 8.4244, 115.0)
    rows = [reading(Gnss(), scene, 0, seed).rows[0] for seed in range(300)]
    errors_m = [math.hypot(*moved_m(row, origin)[:2]) for row in rows]

    assert np.median(errors_m) == pytest.approx(2.5, rel=0.12)


def test_errors_of_position_wander_slowly() -> None:
    """Neighbouring fixes share most of their error: the white part alone differs."""
    rows = readings(Gnss(), still(20.0), 100)
    north = (rows["latitude_deg"] - rows["latitude_deg"][0]) * 111_209.5

    assert np.diff(north).std() == pytest.approx(0.5 * math.sqrt(2), rel=0.25)


def canyon(walls: int) -> Scene:
    tall = ((-1.0, -60.0, 0.0), (1.0, 60.0, 80.0))
    poses = [SE3.about_z(k * 0.5 * math.pi) @ SE3((4.0, 0.0, 0.0)) for k in range(walls)]
    others = [thing(k + 2, f"wall/{k}", "building", p, tall) for k, p in enumerate(poses)]
    return world(straight((0.0, 0.0), (0.0, 0.0)), others)


def test_walls_hide_satellites_and_spoil_the_fix() -> None:
    """Between four of 80 m there is none; between two it is worse than in the open."""
    sensor = Gnss(satellites=24)
    free, between, shut = (reading(sensor, canyon(k)).rows[0] for k in (0, 1, 4))

    assert free["satellites"] == 24
    assert 4 <= between["satellites"] < 24
    assert between["horizontal_sigma_m"] > free["horizontal_sigma_m"]
    assert shut["satellites"] < 4
    assert shut["quality"] == 0
    assert np.isnan(shut["latitude_deg"])


def ideal_odometer(**fields: float) -> Odometer:
    errors = (
        "scale_error distance_step_m speed_noise_m_s yaw_rate_noise_rad_s yaw_rate_bias_rad_s"
        " steering_noise_rad"
    )
    return Odometer(**{**dict.fromkeys(errors.split(), 0.0), **fields})


def test_ideal_odometer_on_a_circle() -> None:
    """20 m, 8 m/s: way, yaw rate, steering angle and wheels follow the Ackermann geometry."""
    rows = readings(ideal_odometer(wheelbase_m=2.7, track_m=1.6), world(circle(20.0, 8.0)), 11)
    last = rows[-1]

    assert last["distance_m"] == pytest.approx(8.0, rel=1e-4)
    assert last["speed_m_s"] == pytest.approx(8.0, rel=1e-3)
    assert last["yaw_rate_rad_s"] == pytest.approx(0.4, rel=1e-3)
    assert last["steering_rad"] == pytest.approx(math.atan(2.7 / 20.0), rel=2e-3)
    assert last["wheel_rear_left_m_s"] == pytest.approx(0.4 * 19.2, rel=1e-3)
    assert last["wheel_front_right_m_s"] == pytest.approx(0.4 * math.hypot(20.8, 2.7), rel=1e-3)


def test_going_backwards_counts_down() -> None:
    """2 m/s against its heading; an encoder of 3 cm counts whole pulses, 0.2 m are 6.67 of them."""
    backwards = world(straight((0.0, 0.0), (-2.0, 0.0)))
    rows = readings(ideal_odometer(), backwards, 6)
    counted = readings(ideal_odometer(distance_step_m=0.03), backwards, 6)

    assert rows["distance_m"][-1] == pytest.approx(-1.0, abs=1e-6)
    assert rows["speed_m_s"][-1] == pytest.approx(-2.0, abs=1e-5)
    pulses = np.rint(counted["distance_m"] / 0.03)
    assert pulses.tolist() == [0, -7, -14, -20, -27, -34]
    assert np.allclose(counted["distance_m"], 0.03 * pulses, atol=1e-6)


def test_scale_error_stays_through_a_sequence() -> None:
    """Distance and speed are wrong by one share, another in every sequence."""
    sensor = ideal_odometer(scale_error=0.05)
    shares = [readings(sensor, world(), 6, seed)["speed_m_s"] / 10.0 for seed in range(40)]

    assert all(np.ptp(share) < 1e-4 for share in shares)
    assert np.std([share[0] for share in shares]) == pytest.approx(0.05, rel=0.35)


def test_unused_walls_leave_inertial_readings_alone() -> None:
    """Objects around it change no inertial reading."""
    walled = world(others=[thing(9, "wall", "building", SE3((30.0, 0.0, 0.0)), WALL_M)])

    assert reading(Imu(), walled, 3).rows.tobytes() == reading(Imu(), world(), 3).rows.tobytes()
