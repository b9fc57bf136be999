"""OpenDRIVE files: what they say becomes lanes and a surface; what is wrong is named."""

import math
import time
from itertools import pairwise
from pathlib import Path

import pytest

from gen_data.assets.library import open_library
from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.scene import Scene
from gen_data.roads.opendrive import read_opendrive
from gen_data.roads.opendrive_lanes import network_lanes, origin_m
from gen_data.scene_templates.road_network import RoadNetwork
from tests.roads.xodr import LANES, town


def test_lanes_are_where_the_file_says() -> None:
    """Right lane of a straight road, about the middle of the town, on its slope."""
    network = read_opendrive(town().encode(), "town.xodr")
    x, y = origin_m(network)
    lanes = {lane.name: lane for lane in network_lanes(network)}
    right, left = lanes["1.0.-1"], lanes["1.0.1"]

    assert right.center_m[0] == pytest.approx((1000 - x, 2000 - y - 1.625, 5.0))
    assert right.center_m[-1] == pytest.approx((1100 - x, 2000 - y - 1.625, 6.0))
    assert left.center_m[0] == pytest.approx((1100 - x, 2000 - y + 1.625, 6.0))
    assert (right.width_m, right.kind) == (3.25, "driving")
    assert right.speed_m_s == pytest.approx(50 / 3.6)
    assert lanes["1.0.2"].center_m[0][2] == pytest.approx(6.12)


def test_paths_lead_through_clothoid_and_junction_without_a_gap() -> None:
    """Straight, clothoid, arc: each successor starts where its lane ends, to a millimetre."""
    lanes = {lane.name: lane for lane in network_lanes(read_opendrive(town().encode(), "town"))}
    path = ["1.0.-1", "2.0.-1", "3.0.-1"]

    for name, after in pairwise(path):
        assert lanes[name].successors == (after,)
        assert math.dist(lanes[name].center_m[-1], lanes[after].center_m[0]) < 1e-3
    assert lanes["3.0.-1"].junction
    assert lanes["2.0.1"].successors == ("1.0.1",)


def test_a_file_in_a_user_folder_is_an_asset_with_lanes(tmp_path: Path) -> None:
    """``user/town``: its mesh is the surface, its element brings the lanes into the scene."""
    (tmp_path / "town.xodr").write_text(town())
    library = open_library([tmp_path], tmp_path / "cache")
    scene = RoadNetwork(name="town", asset="user/town", at_m=(10.0, 0.0)).add(Scene("t"), library)
    low, high = library.bounds_m("user/town")
    moved = {lane.name: lane for lane in scene.lanes}["town/1.0.-1"]
    own = {lane.name: lane for lane in library.lanes("user/town")}["1.0.-1"]

    assert high[0] - low[0] > 155.0
    assert moved.center_m[0][0] == pytest.approx(own.center_m[0][0] + 10.0)
    assert moved.successors == ("town/2.0.-1",)
    assert library.lanes("road") == ()
    with pytest.raises(ConfigError, match=r"expected an \.xodr file"):
        RoadNetwork(name="town", asset="road").add(Scene("t"), library)


@pytest.mark.hostile
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('x="1000"', 'x="nan"', "road '1': x is not finite"),
        ('<geometry s="0" x="1000" y="2000" hdg="0" length="100"><line/></geometry>', "",
         "road '1': it has no geometry"),
        ('<road id="1" length="100"', '<road id="1" length="90"', "road '1': its length is 90"),
        ("<line/>", "<bezier/>", "road '1': a geometry is neither"),
        ('elementType="road" elementId="2"', 'elementType="road" elementId="7"',
         "road '1': its successor '7' is not in the file"),
        ('incomingRoad="2"', 'incomingRoad="8"', "junction '9': road '8' is not in the file"),
        ('<road id="2"', '<road id="1"', "road '1': its id is missing or taken"),
        ('<lane id="2" type="sidewalk">', '<lane id="5" type="sidewalk">',
         "not numbered without gaps"),
        ('<elevation s="0" a="5"', '<elevation s="0"', "road '1': 'a' is missing"),
        ('curvEnd="0.02"', 'curvEnd="1e9"', "road '2': a curvature of 1e+09 per metre"),
        ('arc curvature="0.02"', 'arc curvature="-1e9"', "road '3': a curvature of -1e+09"),
        ('<spiral curvStart="0" curvEnd="0.02"/>', '<poly3 a="0" b="0" c="0" d="1e300"/>',
         "road '2': a poly3 with a slope"),
        ('a="3.25"', 'a="1e9"', "road '1': lane 1 is 1e+09 m wide"),
        ('a="3.25" b="0"', 'a="3.25" b="1e300"', "road '1': lane 1 is 1e+302 m wide"),
        ('<elevation s="0" a="5"', '<elevation s="0" a="1e9"', "road '1': it reaches 1e+09 m"),
        ("<OpenDRIVE>", "<Open>", "malformed XML"),
        ('<?xml version="1.0"?>', '<!DOCTYPE x [<!ENTITY e "a">]>', "declares a document type"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused_with_its_road(old: str, new: str, message: str) -> None:
    """One message with file, road and remedy."""
    text = town()
    assert old in text
    with pytest.raises(AssetError, match=r"^town\.xodr") as caught:
        read_opendrive(text.replace(old, new, 1).encode(), "town.xodr")
    assert message in str(caught.value)


def test_a_file_with_more_lanes_than_a_city_is_refused_at_once() -> None:
    lanes = LANES.replace("<link>", "<!--").replace("</link>", "-->")
    roads = "".join(
        f'<road id="{k}" length="50000"><planView>'
        f'<geometry s="0" x="0" y="{100 * k}" hdg="0" length="50000"><line/></geometry>'
        f"</planView>{lanes}</road>"
        for k in range(300)
    )
    started_s = time.process_time()
    with pytest.raises(AssetError, match=r"more than 500 km of lanes; cut out the part"):
        read_opendrive(f"<OpenDRIVE>{roads}</OpenDRIVE>".encode(), "country.xodr")
    assert time.process_time() - started_s < 5.0


def test_a_gap_between_pieces_is_refused() -> None:
    whole = '<geometry s="0" x="1000" y="2000" hdg="0" length="100"><line/></geometry>'
    halves = (
        '<geometry s="0" x="1000" y="2000" hdg="0" length="50"><line/></geometry>'
        '<geometry s="50" x="1050" y="2000.02" hdg="0" length="50"><line/></geometry>'
    )
    with pytest.raises(AssetError, match=r"town: road '1': its geometry has a gap of 0\.020 m"):
        read_opendrive(town().replace(whole, halves).encode(), "town")


def test_lanes_that_do_not_meet_are_refused() -> None:
    """A link to a road half a metre away."""
    text = town().replace('x="1100" y="2000"', 'x="1100" y="2000.5"')
    with pytest.raises(AssetError, match=r"road '1': lane -1 ends 0\.50 m from lane '2\.0\.-1'"):
        network_lanes(read_opendrive(text.encode(), "town"))
