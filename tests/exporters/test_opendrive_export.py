"""OpenDRIVE files of own streets, read back by the reader of the elements."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.lane_geometry import border_line, left_normals
from gen_data.core.scene import Lane, Scene
from gen_data.exporters.opendrive import OpenDrive
from gen_data.exporters.opendrive_roads import TYPES
from gen_data.exporters.opendrive_xml import opendrive_bytes
from gen_data.roads.lane_graph import stations
from gen_data.roads.opendrive import Network, Road, Section, read_opendrive
from gen_data.roads.opendrive_lanes import network_lanes, origin_m
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.road import Road as RoadElement
from tests.exporters.label_readers import json_lines
from tests.exporters.test_nuscenes_expansions import streets, town
from tests.libraries import library
from tests.roads.test_turn_lanes import crossing

FINE_M = 0.1


def network(scene: Scene) -> Network:
    return read_opendrive(opendrive_bytes(scene, library(), "streets"), "streets.xodr")


def borders(read: Network) -> Iterator[tuple[Road, Section, int, Any]]:
    """Both borders of every lane [2, n, 3], sampled finely."""
    for road in read.roads.values():
        for section in road.sections:
            s = stations(section.start_m, section.end_m, FINE_M)
            edges = road.boundaries_m(section, s)
            # A profile has a step where a kerb rises: each lane is read just inside its borders.
            for number in (n for n in section.lanes if n):
                inner, outer = edges[number - (1 if number > 0 else -1)], edges[number]
                inset = 1e-6 * np.sign(outer - inner)
                pair = [road.points(section, s, t, np.zeros(len(s)))
                        for t in (inner + inset, outer - inset)]  # fmt: skip
                yield road, section, number, np.array(pair)


def gaps_m(points: Any, line: Any) -> Any:
    """Distances of points [n, 3] from a line [m, 3]."""
    near = np.linalg.norm(points[:, None] - line[None], axis=2).argmin(axis=1)
    found = np.full(len(points), np.inf)
    for first in (np.maximum(near - 1, 0), np.minimum(near, len(line) - 2)):
        start, step = line[first], line[first + 1] - line[first]
        share = np.clip(((points - start) * step).sum(1) / (step * step).sum(1), 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(points - start - share[:, None] * step, axis=1))
    return found


def problems(scene: Scene, read: Network, ends: int = 0) -> Iterator[str]:
    """Lanes of a scene without a lane in the file whose borders are the same within 1 mm.

    Args:
        scene: Scene with lanes.
        read: The file.
        ends: Points at each end that are left out: there, borders of the scene are across the last
            step of the lane, not across its curve.
    """
    found = list(borders(read))
    curved = {lane.road for lane in scene.lanes if lane.junction}
    for lane in scene.lanes:
        if lane.kind not in TYPES:
            continue
        inner = slice(ends, len(lane.center_m) - ends) if lane.road in curved else slice(None)
        own = [np.array(border_line(lane, side))[inner] for side in ("left", "right")]
        middle = own[0][len(own[0]) // 2]
        fitting = [
            number
            for road, section, number, pair in found
            if np.abs(pair - middle).sum(axis=2).min() < 0.1
            and section.lanes[number].kind == TYPES[lane.kind]
            and all(
                min(gaps_m(line, other).max() for other in pair) < 1e-3 for line in own
            )
        ]  # fmt: skip
        if len(fitting) != 1:
            yield f"{lane.name}: {fitting}"


def test_lanes_are_read_back_with_the_same_borders_kinds_speeds_and_links() -> None:
    """Within 1 mm; lanes are recognised by their ends."""
    scene = streets()
    read = network(scene)
    assert list(problems(scene, read, ends=1)) == []
    assert len(read.roads) == 3 + 8 + 3 and [len(c) for c in read.junctions.values()] == [11]
    x, y = origin_m(read)
    places = [lane for lane in scene.lanes if lane.kind == "driving"]
    ends = np.array([(lane.center_m[0], lane.center_m[-1]) for lane in places])
    lanes = [lane for lane in network_lanes(read) if lane.kind == "driving"]
    owners: dict[str, Lane] = {}
    for lane in lanes:
        away_m = np.abs(ends - np.array([lane.center_m[0], lane.center_m[-1]]) - (x, y, 0.0))
        (fitting,) = np.flatnonzero(away_m.max(axis=(1, 2)) < 1e-3)
        owners[lane.name] = places[fitting]
    names = {name: lane.name for name, lane in owners.items()}
    assert len(set(names.values())) == len(places) == len(lanes)
    for lane in lanes:
        own = owners[lane.name]
        assert {names[name] for name in lane.successors} == set(own.successors)
        facts = [(k.junction, k.width_m, k.speed_m_s) for k in (lane, own)]
        assert facts[0] == facts[1]
        sides = names.get(lane.left, ""), names.get(lane.right, "")
        assert sides == (own.left, own.right)


def test_turn_lanes_and_left_hand_traffic_are_read_back() -> None:
    scene = crossing(traffic="left")
    read = network(scene)
    assert list(problems(scene, read, ends=1)) == []
    assert next(road.left_hand for road in read.roads.values())


def test_bends_are_circles_of_their_radius() -> None:
    """The middle of the road, seen from its end: it turns to the right."""
    bend = RoadElement(name="main", length_m=60.0, curvature_per_m=0.02)
    (road,) = network(build_scene("street", (bend,), library())).roads.values()
    s = np.arange(0.0, road.line.length_m, 0.5)
    x, y, heading = road.line.poses(s).T
    center = np.array([x, y]) - 50.0 * np.array([-np.sin(heading), np.cos(heading)])
    assert road.line.length_m == pytest.approx(60.0, abs=1e-5)
    assert np.ptp(center, axis=1).max() < 1e-4


def test_heights_and_cross_slopes_of_relief_are_read_back() -> None:
    """A street that is lifted by waves: elevation and shape follow within 1 mm."""

    def lifted(lane: Lane) -> Lane:
        center = np.array(lane.center_m)
        aside = left_normals(center)
        raised = center + [0.0, 0.0, 1.0] * hill(center)[:, None]
        banks = lane.bank + (hill(center + aside) - hill(center - aside)) / 2.0
        return replace(
            lane, center_m=tuple(map(tuple, raised.tolist())), banks=tuple(banks.tolist())
        )

    def hill(points: Any) -> Any:
        return 0.6 * np.sin(points[:, 0] / 15.0) + 0.03 * points[:, 1]

    scene = streets()
    scene = replace(scene, lanes=tuple(lifted(lane) for lane in scene.lanes))
    assert list(problems(scene, network(scene), ends=1)) == []


def test_marks_and_crosswalks_are_those_of_the_mesh() -> None:
    """Dashes in the middle and between lanes; corners of crosswalks are placed by the file."""
    read = network(streets())
    roads = [road for road in read.roads.values() if not road.junction]
    for road in roads:
        (section,) = road.sections
        kinds = {n: {m.kind for _, m in lane.marks} for n, lane in section.lanes.items()}
        assert kinds[0] == kinds[1] == kinds[-1] == {"broken"}
        assert kinds[2] == kinds[-2] == {"none"}
    root = ElementTree.fromstring(opendrive_bytes(streets(), library(), "streets"))
    corners = [np.array(outline) for outline in crosswalk_corners(root, read)]
    own = [lane for lane in streets().lanes if lane.kind == "crosswalk"]
    assert len(corners) == len(own) == 3
    for lane in own:
        expected = np.array([*border_line(lane, "right"), *border_line(lane, "left")[::-1]])
        assert min(np.abs(found - expected).max() for found in corners) < 1e-4


def crosswalk_corners(root: Any, read: Network) -> Iterator[list[Any]]:
    """Corners of outlines in the world, by the frame of their object."""
    for element in root.iter("road"):
        road = read.roads[element.get("id")]
        for item in element.iter("object"):
            s = np.array([float(item.get("s"))])
            x, y, heading = road.line.poses(s)[0]
            z = road.elevation_m(s)[0]
            yield [
                (x + u * math.cos(heading) - v * math.sin(heading),
                 y + u * math.sin(heading) + v * math.cos(heading), z + w)
                for corner in item.iter("cornerLocal")
                for u, v, w in [[float(corner.get(key)) for key in "uvz"]]
            ]  # fmt: skip


def check_files(folder: Path) -> None:
    for path in sorted(folder.glob("*.xodr")):
        assert list(problems(streets(), read_opendrive(path.read_bytes(), path.name), ends=1)) == []


def test_every_world_has_a_file_and_every_sample_names_it(world: Any, tmp_path: Path) -> None:
    folder = world.export(OpenDrive(), *town(world), tmp_path, assets=library())
    rows = json_lines(folder / "worlds.jsonl")
    assert Counter(row["world"] for row in rows) == {"000000.xodr": 4, "000001.xodr": 4}
    assert [row["index"] for row in rows] == list(range(8))
    assert len(list(folder.glob("*.xodr"))) == 2
    check_files(folder)


def test_lanes_whose_width_changes_are_refused() -> None:
    line = ((0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    taper = Lane("town/1.0.-1", "driving", line, 3.0, widths_m=(2.5, 3.5))
    with pytest.raises(ConfigError, match=r"^exporter 'opendrive': lane 'town/1\.0\.-1' changes"):
        OpenDrive().check_scene(Scene("street", lanes=(taper,)))
