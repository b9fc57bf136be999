"""Data sheets and tables of beams of the user's own, and sensors where they cannot see."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from gen_data.assemble.config import Config, load_config
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Rig, Scene
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from gen_data.sensors.lidar.scan_pattern import make_sweep
from gen_data.sensors.mounting import check_not_buried
from tests.renderers.fake_library import FakeLibrary, box_mesh

SHEET = """\
elevations_deg: [{first: 1, last: -1, count: 3}]
rotation_hz: 20
points_per_second: 6000
range_m: [0.5, 60]
range_noise_m: 0.01
range_step_m: 0
divergence_mrad: 3
pulse_m: 1
wavelength_nm: 905
seen: {reflectance: 0.1, range_m: 50}
white_intensity: 0.4
"""
PLACE = re.compile(r"\w+\.(?:yaml|csv):\d+:\d+: ")
CONFIG = """\
template: street
sensors:
  - {type: rgb_camera}
  - type: lidar
    %s
"""


def spec(folder: Path, line: str, **files: str) -> Config:
    for name, text in files.items():
        (folder / name.replace("_", ".", 1)).write_text(text, encoding="utf-8")
    (folder / "mine.yaml").write_text(CONFIG % line, encoding="utf-8")
    return load_config(str(folder / "mine.yaml"))


def told(folder: Path, line: str, **files: str) -> str:
    with pytest.raises(ConfigError) as refused:
        spec(folder, line, **files)
    return str(refused.value).replace(f"{folder}/", "")


@pytest.mark.slow
def test_a_data_sheet_beside_the_configuration_is_a_model(tmp_path: Path) -> None:
    """Its name is the file's; the scanner has its lasers and its turns."""
    sensor = spec(tmp_path, "model: ./sheet.yaml", sheet_yaml=SHEET).sensors[1]

    assert sensor.device.name == "sheet"
    assert len(make_sweep(sensor.device, 0.0).ring) == 6000 // 20
    np.testing.assert_allclose(np.degrees(sensor.device.elevations_rad()), [1, 0, -1])


@pytest.mark.slow
def test_a_plan_holds_the_data_sheet_and_needs_no_file(tmp_path: Path) -> None:
    """Other numbers in the file are another data set; a plan is made again without it."""
    made = spec(tmp_path, "model: sheet.yaml", sheet_yaml=SHEET)
    other = spec(tmp_path, "model: sheet.yaml", sheet_yaml=SHEET.replace("20", "10"))
    assert made.resolved != other.resolved
    (tmp_path / "sheet.yaml").unlink()
    plan = canonical_json({"config": made.resolved, "name": "mine"})
    (tmp_path / "plan.json").write_text(plan, encoding="utf-8")

    assert load_config(str(tmp_path)).sensors == made.sensors


@pytest.mark.slow
def test_a_table_of_beams_replaces_the_lasers_of_a_model(tmp_path: Path) -> None:
    """Sorted from the top, each with its own offset to the left; comments are skipped."""
    table = "azimuth_offset_deg, elevation_deg\n# down first\n-2, -10\n\n4, 5  # up\n"
    device = spec(tmp_path, "beams: table.csv", table_csv=table).sensors[1].device

    sweep = make_sweep(device, 0.0)
    elevation = np.degrees(np.arcsin(sweep.directions[:2, 2].astype(float)))
    azimuth = np.degrees(np.arctan2(sweep.directions[:2, 1], sweep.directions[:2, 0]))
    np.testing.assert_allclose(elevation, [5.0, -10.0], atol=1e-4)
    assert azimuth[0] - azimuth[1] == pytest.approx(6.0, abs=1e-3) or math.isclose(
        abs(azimuth[0] - azimuth[1]), 354.0, abs_tol=1e-3
    )
    assert device.rotation_hz == 10


CAR = FakeLibrary({"car": box_mesh((4.0, 1.8, 1.5))})
STREET = Scene(
    "street", (Body("ego", "car", SE3((0.0, 0.0, 0.75))),),
    rigs=(Rig("rig", "ego", SE3((-1.2, 0.0, -0.75))),),
)  # fmt: skip


@pytest.mark.parametrize("kind", [LidarSensor, RgbCamera])
@pytest.mark.parametrize(("offset_m", "buried"), [
    ((1.2, 0.0, 1.73), False),
    ((1.2, 0.0, 1.46), False),
    ((1.2, 0.0, 1.4), True),
    ((3.5, 0.0, 0.7), False),
    ((2.0, 0.5, 0.7), True),
])  # fmt: skip
def test_sensors_inside_the_body_that_carries_them_are_refused(
    kind: type[LidarSensor | RgbCamera], offset_m: tuple[float, float, float], buried: bool
) -> None:
    """A car 1.5 m high: five centimetres are tolerated, and ``inside`` turns the check off."""
    sensor = kind(name="top", rig="rig", offset_m=offset_m)
    scene = sensor.mount(STREET)
    if buried:
        with pytest.raises(ConfigError, match=r"'top': offset_m .* inside 'ego'.* at 1.50 m"):
            check_not_buried(scene, "top", CAR)
    else:
        check_not_buried(scene, "top", CAR)

    assert sensor.describe().needs_clear_view
    assert not sensor.model_copy(update={"inside": True}).describe().needs_clear_view


def test_a_sheet_of_a_few_lines_has_the_rest_of_a_named_scanner(tmp_path: Path) -> None:
    """VLP-16: 1,808 columns a turn, 2.79 mrad; its own lasers from the top, its turns and range."""
    text = "like: VLP-16\nelevations_deg: [-10, -5, 0, 5]\nrotation_hz: 20\nrange_m: [0.2, 40]\n"
    device = spec(tmp_path, "model: short.yaml", short_yaml=text).sensors[1].device

    np.testing.assert_allclose(np.degrees(device.elevations_rad()), [5, 0, -5, -10])
    assert (device.name, device.rotation_hz, device.range_m) == ("short", 20, (0.2, 40))
    assert (device.divergence_mrad, device.seen.range_m, device.wavelength_nm) == (3.0, 50, 903)
    assert len(make_sweep(device, 0.0).ring) == 4 * round(289352 / 10 / 16)


FIRED_DEG = (-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0)
"""Elevations of the first lasers of a VLP-16, in the order in which they fire."""


def test_lasers_listed_in_the_order_of_firing_keep_their_own_offsets(tmp_path: Path) -> None:
    """Each pulse leaves at its laser's elevation, turned and shifted as listed for that laser."""
    left_deg = [0.1 * k for k in range(8)]
    side_m = [0.001 * k for k in range(8)]
    text = (f"like: VLP-16\nelevations_deg: {list(FIRED_DEG)}\nazimuth_offsets_deg: {left_deg}\n"
            f"lateral_offsets_m: {side_m}\nazimuth_step_deg: 90\n")  # fmt: skip
    device = spec(tmp_path, "model: s.yaml", s_yaml=text).sensors[1].device
    sweep = make_sweep(device, 0.0)

    first = sweep.directions[:8]
    elevation = np.degrees(np.arcsin(first[:, 2]))
    # The first column is at 180 - 45 degrees; the axis of rotation is X = Y = 0.
    turned = np.degrees(np.arctan2(first[:, 1], first[:, 0])) - 135.0
    assert sweep.origins_m is not None
    beside = np.hypot(*sweep.origins_m[:8, :2].T)
    found = {round(float(up), 3): (round(float(a), 3), round(float(m), 6))
             for up, a, m in zip(elevation, turned, beside, strict=True)}  # fmt: skip
    expected = {up: (round(a, 3), m) for up, a, m in zip(FIRED_DEG, left_deg, side_m, strict=True)}
    assert found == expected
    assert list(elevation) == sorted(elevation, reverse=True)


@pytest.mark.slow
def test_a_step_in_azimuth_gives_the_pulses_of_a_turn(tmp_path: Path) -> None:
    """0.5 degrees: 720 of each laser, at any speed of rotation; 2 s / 20 turns / 720 apart."""
    text = "like: OS1-64\nelevations_deg: [3, 1, -2]\nazimuth_step_deg: 0.5\n"
    for line in ("model: s.yaml", "model: s.yaml\n    rotation_hz: 5"):
        sensor = spec(tmp_path, line, s_yaml=text).sensors[1]
        assert len(make_sweep(sensor.device, 0.0).ring) == 3 * 720
        # Its own lasers have no offsets of the other scanner's.
        assert sensor.device.azimuth_offsets_deg == ()


SHORT, TABLE, OTHER = "model: s.yaml", "beams: table.csv", "mine.yaml:5:12: "
FAULTS = [
    (TABLE, "elevation_rad\n1\n", "table.csv:1:1: unknown column 'elevation_rad'; expected"),
    (TABLE, "azimuth_offset_deg\n1\n", "table.csv:1:1: expected columns elevation_deg"),
    (TABLE, "elevation_deg\n1\n one\n",
     "table.csv:3:2: elevation_deg: expected a number, got 'one'"),
    (TABLE, "elevation_deg\n1, 2\n", "table.csv:2:1: expected 1 numbers, got 2"),
    (TABLE, "elevation_deg\n1\n-91\n", "table.csv:3:1: sensors[1].beams[1][0]"),
    (TABLE, "", "table.csv:1:1: expected columns"),
    (SHORT, SHEET.replace("60]", "6o]"), "s.yaml:4:16: sensors[1].model.ran"),
    (SHORT, SHEET.replace("range_noise_m", "range_noise_cm"),
     "s.yaml:1:1: sensors[1].model.range_noise_m: miss | s.yaml:5:1: sensors[1].model.range_noi"),
    ("model: none.yaml", SHEET, OTHER + "there is no file 'none.yaml'"),
    ("model: table.csv", SHEET, OTHER + "model: a table of beams belongs into 'beams'"),
    ("beams: s.yaml", SHEET, OTHER + "beams: expected a list, or the name of a"),
    ("model: HDL64", SHEET, OTHER + "sensors[1].model: expected one of"),
    (SHORT, "elevations_deg: [-10, -5, 0, 5]\n",
     "s.yaml:1:1: lacks rotation_hz, range_m, range_noise_m, range_step_m, divergence_mrad, "
     "pulse_m, wavelength_nm, seen, white_intensity; give them, or name a scanner that has the "
     "same: like: VLP-16"),
    (SHORT, "like: VLP\n", "s.yaml:1:7: like: expected one of HDL-32E"),
    *((SHORT, f"like: VLP-16\n{rest}\n", f"s.yaml:{fact}") for rest, fact in (
        ("elevations_deg: [a]", "2:18: sensors[1].model.elevations_deg[0]"),
        ("elevations_deg: [95]", "2:18: sensors[1].model.elevations_deg[0]"),
        ("elevations_deg: []", "1:1: sensors[1].model: expected either elevations_deg or prisms"),
        ("points_per_second: 9\nazimuth_step_deg: 1",
         "1:1: sensors[1].model: expected either points_per_second or azimuth_step_deg"),
        ("rate_hz: 9", "2:1: sensors[1].model.rate_hz: unknown key 'rate_hz'"),
    )),
    # Offsets that belong to no laser.
    *((SHORT, f"like: VLP-16\nelevations_deg: {lasers}\nazimuth_offsets_deg: {offsets}\n",
       f"s.yaml:3:22: sensors[1].model.azimuth_offsets_deg: expected one number for each of {fact}")
      for lasers, offsets, fact in (
        ("[-10, 5, 0, -5]", "[1, 2]",
         "4 lasers, as they are not listed from the top, or fewer that repeat evenly, got 2"),
        ("[5, 0, -5]", "[1, 2]", "3 lasers, or fewer that"),
        ("[5, 0]", "[1, 2, 3]", "2 lasers, or fewer that"),
        ("[{first: 5, last: 0, count: 4}]", "[1, 2, 3]", "4 lasers, or fewer"),
    )),
]  # fmt: skip


@pytest.mark.parametrize(("line", "content", "expected"), FAULTS)
def test_faults_of_sheets_and_tables_are_refused_in_one_message_at_their_place(
    tmp_path: Path, line: str, content: str, expected: str
) -> None:
    files = {"table_csv" if line == TABLE else "s_yaml": content}
    message = told(tmp_path, line, **files)
    facts = expected.split(" | ")
    assert all(fact in message for fact in facts)
    assert len(PLACE.findall(message)) == len(facts)
