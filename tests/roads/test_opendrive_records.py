"""Records of OpenDRIVE files that change along a road, and newer elements of the standard."""

import cmath
import math
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.checking import check_folder
from gen_data.assets.library import open_library
from gen_data.content.roads.network_surface import network_solid
from gen_data.core.errors import AssetError
from gen_data.core.lane_geometry import border_line, lane_borders
from gen_data.core.scene import Lane
from gen_data.exporters.road_map import lane_area
from gen_data.roads.opendrive import read_opendrive
from gen_data.roads.opendrive_lanes import network_lanes

WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
SOLID = '<roadMark sOffset="0" type="solid" width="0.12"/>'


def lane(number: int, inner: str = WIDTH, more: str = "", kind: str = "driving") -> str:
    return f'<lane id="{number}" type="{kind}" {more}>{inner}</lane>'


def road(  # noqa: PLR0917
    left: str = "",
    right: str = "",
    lateral: str = "",
    types: str = "",
    number: int = 1,
    x: int = 0,
    link: str = "",
    center: str = "",
) -> str:
    return (
        f'<road length="100" id="{number}" junction="-1"><link>{link}</link>{types}'
        f'<planView><geometry s="0" x="{x}" y="0" hdg="0" length="100"><line/></geometry>'
        "</planView>"
        f'<lateralProfile>{lateral}</lateralProfile><lanes><laneSection s="0">'
        f'<left>{left}</left><center><lane id="0" type="none">{center}</lane></center>'
        f"<right>{right}</right></laneSection></lanes></road>"
    )


def text(*roads: str, more: str = "") -> bytes:
    return f'<?xml version="1.0"?><OpenDRIVE>{"".join(roads)}{more}</OpenDRIVE>'.encode()


def lanes(*roads: str, more: str = "") -> dict[str, Lane]:
    return {x.name: x for x in network_lanes(read_opendrive(text(*roads, more=more), "a.xodr"))}


def painted_m(*roads: str, edge_m: float, reach_m: float = 0.2) -> list[tuple[float, float]]:
    """From where to where along the road the line at ``y = edge_m`` is painted."""
    mesh = network_solid(read_opendrive(text(*roads), "a.xodr")).mesh
    slots = [k for k, material in enumerate(mesh.materials) if material.role == "marking"]
    faces = mesh.faces[np.isin(mesh.face_slots, slots)]
    corners = mesh.vertices_m[faces].astype(float)
    corners = corners[np.abs(corners[..., 1] - edge_m).max(axis=1) < reach_m] + [50.0, 0.0, 0.0]
    spans = sorted((c[:, 0].min(), c[:, 0].max()) for c in corners)
    merged: list[list[float]] = []
    for low, high in spans:
        if merged and low <= merged[-1][1] + 1e-3:
            merged[-1][1] = max(high, merged[-1][1])
        else:
            merged.append([low, high])
    return [(round(float(low), 3), round(float(high), 3)) for low, high in merged]


# --- marks ---


@pytest.mark.parametrize(
    ("marks", "spans"),
    [
        ('<roadMark sOffset="0" type="none"/><roadMark sOffset="50" type="solid"/>', [(50, 100)]),
        ('<roadMark sOffset="50" type="none"/><roadMark sOffset="0" type="solid"/>', [(0, 50)]),
        ('<roadMark sOffset="20" type="solid"/>', [(20, 100)]),
        (SOLID + '<roadMark sOffset="40" type="none"/><roadMark sOffset="60" type="solid"/>',
         [(0, 40), (60, 100)]),
        (SOLID + '<roadMark sOffset="85" type="broken"/>', [(0, 87), (93, 96)]),
        ("", []),
    ],
)  # fmt: skip
def test_marks_change_along_the_road(marks: str, spans: list[tuple[float, float]]) -> None:
    """Each record holds from its sOffset to the next; dashes keep the rhythm of the section.

    Dashes are 3 m every 9 m, the first from 3 m: 2 m are left of that at 84 m.
    """
    found = painted_m(road(right=lane(-1, WIDTH + marks)), edge_m=-3.5)
    assert len(found) == len(spans)
    np.testing.assert_allclose(np.ravel(found), np.ravel(spans), atol=2e-3)


DASHES = [(3 + 9 * k, 6 + 9 * k) for k in range(11)]
WHOLE = [(0, 100)]


@pytest.mark.parametrize(
    ("kind", "number", "upper", "lower"),
    [
        ("solid broken", -1, WHOLE, DASHES),
        ("solid broken", 0, WHOLE, DASHES),
        ("solid broken", 1, DASHES, WHOLE),
        ("broken solid", -1, DASHES, WHOLE),
        ("broken solid", 1, WHOLE, DASHES),
        ("solid solid", 0, WHOLE, WHOLE),
        ("broken broken", -1, DASHES, DASHES),
        ("botts dots", -1, [], []),
        ("edge", -1, [], []),
    ],
)
def test_double_marks_are_listed_from_the_inside_out(
    kind: str, number: int, upper: list[tuple[float, float]], lower: list[tuple[float, float]]
) -> None:
    """ASAM OpenDRIVE 1.6, 9.6: of the centre lane from left to right."""
    mark = f'<roadMark sOffset="0" type="{kind}" width="0.12"/>'
    sides = {n: WIDTH + mark * (n == number) for n in (1, -1)}
    made = road(lane(1, sides[1]), lane(-1, sides[-1]), center=mark if number == 0 else "")
    edge_m = 3.5 * number
    for spans, aside_m in ((upper, 0.12), (lower, -0.12)):
        found = painted_m(made, edge_m=edge_m + aside_m, reach_m=0.07)
        assert len(found) == len(spans)
        np.testing.assert_allclose(np.ravel(found), np.ravel(spans), atol=2e-3)


@pytest.mark.parametrize(("color", "yellow"), [("yellow", True), ("white", False)])
def test_paint_has_the_colour_of_the_file(color: str, yellow: bool) -> None:
    mark = f'<roadMark sOffset="0" type="solid" width="0.12" color="{color}"/>'
    mesh = network_solid(read_opendrive(text(road(right=lane(-1), center=mark)), "a.xodr")).mesh
    painted = [mesh.materials[k] for k in np.unique(mesh.face_slots)]
    (paint,) = [material for material in painted if material.role == "marking"]
    red, _, blue = paint.base_color
    assert (red > 2.0 * blue) == yellow


def test_marks_in_a_junction_and_the_place_on_the_globe_are_named() -> None:
    """Ways through a junction overlap: their marks are not painted."""
    head = "<header><geoReference>+proj=utm +zone=32</geoReference></header>"
    none = '<roadMark sOffset="50" type="none"/>'
    way = road(right=lane(-1, WIDTH + SOLID + none)).replace('junction="-1"', 'junction="9"')
    network = read_opendrive(text(way, more=head + '<junction id="9"/>'), "a.xodr")
    assert network.unused == {"geoReference of header": 1, "roadMark in a junction": 1}


def test_marks_that_are_painted_otherwise_are_named() -> None:
    marks = "".join(
        f'<roadMark sOffset="{k}" type="{kind}" color="{color}"/>'
        for k, (kind, color) in enumerate([
            ("solid", "standard"), ("botts dots", "white"), ("broken", "red"), ("curb", "white"),
        ])
    )  # fmt: skip
    network = read_opendrive(text(road(right=lane(-1, WIDTH + marks))), "a.xodr")
    assert network.unused == {"color='red' of roadMark": 1, "type='botts dots' of roadMark": 1}


# --- speeds ---

TOWN = '<type s="0" type="town"><speed max="50" unit="km/h"/></type>'
TYPES = (
    TOWN + '<type s="40" type="rural"><speed max="100" unit="km/h"/></type>'
    '<type s="70" type="motorway"><speed max="no limit"/></type>'
)


def test_the_speed_of_a_road_changes_along_it() -> None:
    """A lane per speed; each leads to the next, and back on the other side."""
    found = lanes(road(lane(1), lane(-1), types=TYPES))

    speeds = [round(found[f"1.{k}.-1"].speed_m_s * 3.6, 6) for k in range(3)]
    assert speeds == [50.0, 100.0, 130.0]
    assert [found[f"1.{k}.-1"].successors for k in range(3)] == [("1.1.-1",), ("1.2.-1",), ()]
    assert [found[f"1.{k}.1"].successors for k in range(3)] == [(), ("1.0.1",), ("1.1.1",)]
    assert found["1.1.-1"].center_m[0][0] == pytest.approx(40 - 50)
    assert found["1.1.-1"].center_m[-1][0] == pytest.approx(70 - 50)


def test_a_lane_may_have_a_speed_of_its_own() -> None:
    """From its sOffset on; the other lane keeps the road's."""
    slow = '<speed sOffset="0" max="30" unit="km/h"/><speed sOffset="60" max="10" unit="m/s"/>'
    found = lanes(road(right=lane(-1) + lane(-2, WIDTH + slow), types=TOWN))

    kmh = {name: round(x.speed_m_s * 3.6, 6) for name, x in found.items() if x.kind == "driving"}
    assert kmh == {"1.0.-1": 50.0, "1.1.-1": 50.0, "1.0.-2": 30.0, "1.1.-2": 36.0}


@pytest.mark.parametrize(
    ("speed", "limit_m_s"),
    [
        ('max="15"', 15.0),
        ('max="36" unit="km/h"', 10.0),
        ('max="25" unit="mph"', 25 * 1609.344 / 3600),
    ],
)
def test_speeds_have_the_units_of_the_standard(speed: str, limit_m_s: float) -> None:
    town = f'<type s="0" type="town"><speed {speed}/></type>'
    assert lanes(road(right=lane(-1), types=town))["1.0.-1"].speed_m_s == pytest.approx(limit_m_s)


def test_an_unknown_unit_of_a_speed_is_refused() -> None:
    """50 "kmh" were 50 m/s."""
    town = '<type s="0" type="town"><speed max="50" unit="kmh"/></type>'
    told = r"^a\.xodr: road '1': the unit 'kmh' of a speed is unknown; expected m/s, km/h, mph$"
    with pytest.raises(AssetError, match=told):
        lanes(road(right=lane(-1), types=town))


@pytest.mark.parametrize("kind", ["mwyEntry", "mwyExit", "slipLane", "HOV"])
def test_lanes_of_ramps_and_full_cars_are_driven(kind: str) -> None:
    assert lanes(road(right=lane(-1, kind=kind)))["1.0.-1"].kind == "driving"


def test_a_connection_without_lanes_is_named() -> None:
    ways = '<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2"/></junction>'
    network = read_opendrive(text(road(right=lane(-1)), road(right=lane(-1), number=2), more=ways),
                             "a.xodr")  # fmt: skip
    assert network.unused == {"connection without laneLink": 1}


def test_a_type_without_a_change_of_speed_splits_nothing() -> None:
    same = TOWN + TOWN.replace('s="0"', 's="30"')
    assert set(lanes(road(right=lane(-1), types=same))) == {"1.0.-1", "1.0.-1/frontage"}


def test_a_split_road_has_the_widths_and_marks_of_the_whole_one() -> None:
    """Records count from the start of the section in the file, not of its part."""
    wider = '<width sOffset="0" a="3" b="0.01" c="0" d="0"/>'
    found = lanes(road(right=lane(-1, wider + SOLID), types=TYPES))
    whole = lanes(road(right=lane(-1, wider + SOLID)))

    ys = [p[1] for k in range(3) for p in found[f"1.{k}.-1"].center_m]
    assert min(ys) == pytest.approx(whole["1.0.-1"].center_m[-1][1])
    assert min(ys) == pytest.approx(-2.0)
    broken = WIDTH + '<roadMark sOffset="0" type="broken"/>'
    assert painted_m(road(right=lane(-1, broken), types=TYPES), edge_m=-3.5) == painted_m(
        road(right=lane(-1, broken)), edge_m=-3.5
    )


# --- lateral profile ---


def z_m(lateral: str, number: int, more: str = "") -> float:
    """Height of the middle of a lane, 1.75 m from the reference line or 5.25 m."""
    pairs = lane(1) + lane(2, more=more), lane(-1) + lane(-2, more=more)
    return lanes(road(*pairs, lateral=lateral))[f"1.0.{number}"].center_m[0][2]


def crossfall(side: str, a: float = 0.05) -> str:
    return f'<crossfall side="{side}" s="0" a="{a}" b="0" c="0" d="0"/>'


@pytest.mark.parametrize(
    ("side", "left", "right"), [("both", True, True), ("left", True, False), ("right", False, True)]
)
def test_crossfall_falls_from_the_reference_line(side: str, left: bool, right: bool) -> None:
    """By 1.75 m times the tangent of 0.05 rad, on its side."""
    fall = -1.75 * math.tan(0.05)
    assert z_m(crossfall(side), 1) == pytest.approx(fall * left, abs=1e-6)
    assert z_m(crossfall(side), -1) == pytest.approx(fall * right, abs=1e-6)


@pytest.mark.parametrize("roll", [0.02, -0.7])
def test_superelevation_rolls_the_cross_section(roll: float) -> None:
    """Lanes of 3.5 m, with a roof on top, as points of a plane that turns about the line.

    A vector along the road is (t, -|t| tan 0.05) across and up, before its rotation by the roll.
    """
    bank = f'<superelevation s="0" a="{roll}" b="0" c="0" d="0"/>'
    found = lanes(road(lane(1) + lane(2), lane(-1), lateral=bank + crossfall("both")))
    for name, t in (("1.0.1", 1.75), ("1.0.2", 5.25), ("1.0.-1", -1.75)):
        up = -abs(t) * math.tan(0.05)
        _, y, z = found[name].center_m[0]
        expected = (t + 1j * up) * cmath.exp(1j * roll)
        assert (y, z) == pytest.approx((expected.real, expected.imag), abs=1e-5)
        fall = math.copysign(math.tan(0.05), t)
        across = 3.5 * (1 - 1j * fall) * cmath.exp(1j * roll)
        assert found[name].width_m == pytest.approx(across.real, abs=1e-5)


SHAPE = (
    '<shape s="{s}" t="-7" a="{a}" b="0" c="0" d="0"/>'
    '<shape s="{s}" t="-3.5" a="{a}" b="{b}" c="0" d="0"/>'
    '<shape s="{s}" t="0" a="0" b="0" c="0.02" d="0"/>'
)


def test_a_shape_is_a_profile_across_the_road() -> None:
    """Level at -1 m beyond 3.5 m to the right, straight up to 0, and a parabola to the left."""
    shape = SHAPE.format(s=0, a=-1.0, b=1 / 3.5)
    assert z_m(shape, -2) == pytest.approx(-1.0)
    assert z_m(shape, -1) == pytest.approx(-0.5)
    assert z_m(shape, 1) == pytest.approx(0.02 * 1.75**2, abs=1e-6)
    assert z_m(shape, 2) == pytest.approx(0.02 * 5.25**2, abs=1e-6)


def test_shapes_are_interpolated_between_their_stations() -> None:
    """Half of the depth in the middle between a flat profile and one of 1 m."""
    shape = SHAPE.format(s=0, a=0.0, b=0.0) + SHAPE.format(s=80, a=-1.0, b=1 / 3.5)
    middle = lanes(road(right=lane(-1) + lane(-2), lateral=shape))["1.0.-2"].center_m
    z = {round(x + 50): height for x, _, height in middle}
    assert (z[0], z[40], z[80], z[100]) == pytest.approx((0.0, -0.5, -1.0, -1.0))


def test_the_surface_follows_the_shape_within_a_lane() -> None:
    """Its middle is where vehicles drive: on the parabola, not on the chord."""
    shape = SHAPE.format(s=0, a=0.0, b=0.0)
    mesh = network_solid(read_opendrive(text(road(lane(1), lateral=shape)), "a")).mesh
    asphalt = mesh.vertices_m[np.abs(mesh.vertices_m[:, 1] - 1.75) < 1e-3]
    np.testing.assert_allclose(asphalt[:, 2].max(), 0.02 * 1.75**2, atol=1e-4)


def test_level_lanes_keep_the_height_of_their_inner_edge() -> None:
    """A sidewalk beyond a road that leans."""
    bank = '<superelevation s="0" a="0.1" b="0" c="0" d="0"/>'
    assert z_m(bank, 2, 'level="true"') == pytest.approx(3.5 * math.sin(0.1), abs=1e-6)
    assert z_m(bank, -2, 'level="true"') == pytest.approx(-3.5 * math.sin(0.1), abs=1e-6)
    assert z_m(bank, 2, 'level="false"') == pytest.approx(5.25 * math.sin(0.1), abs=1e-6)


# --- lanes ---


def test_a_reversed_lane_runs_against_its_side() -> None:
    """Its neighbour of the other direction is no lane to change to."""
    found = lanes(road(right=lane(-1) + lane(-2, more='direction="reversed"') + lane(-3)))

    assert found["1.0.-1"].center_m[0][0] < found["1.0.-1"].center_m[-1][0]
    assert found["1.0.-2"].center_m[0][0] > found["1.0.-2"].center_m[-1][0]
    assert (found["1.0.-1"].right, found["1.0.-2"].left, found["1.0.-2"].right) == ("", "", "")


def test_borders_are_outer_edges_at_t() -> None:
    """A signed distance from the reference line, also where inner lanes change width."""

    def border(a: float, b: float = 0.0) -> str:
        return f'<border sOffset="0" a="{a}" b="{b}" c="0" d="0"/>'

    found = lanes(
        road(
            lane(1, border(3)) + lane(2, border(7)),
            lane(-1, border(-3, -0.01)) + lane(-2, border(-6)),
        )
    )
    assert (found["1.0.1"].width_m, found["1.0.2"].width_m) == (3.0, 4.0)
    assert found["1.0.-1"].center_m[0][1] == pytest.approx(-1.5)
    assert found["1.0.-1"].center_m[-1][1] == pytest.approx(-2.0)
    assert found["1.0.-2"].center_m[-1][1] == pytest.approx(-5.0)


@pytest.mark.parametrize(
    ("inner", "told"),
    [
        ('<width sOffset="0" a="3" b="-0.05" c="0" d="0"/>', "lane -1 is -2 m wide at s = 100 m"),
        ('<border sOffset="0" a="3" b="0" c="0" d="0"/>', "lane -1 is -3 m wide at s = 0 m"),
    ],
)
def test_a_lane_of_negative_width_is_refused_with_its_place(inner: str, told: str) -> None:
    with pytest.raises(AssetError, match=rf"^a\.xodr: road '1': {told}; correct its width"):
        lanes(road(right=lane(-1, inner)))


def test_a_lane_may_end_in_a_taper() -> None:
    """Its link to the lane that it merges into is none to drive along."""
    taper = '<link><successor id="-1"/></link><width sOffset="0" a="3.5" b="-0.035" c="0" d="0"/>'
    on = '<link><successor id="-1"/></link>' + WIDTH
    link = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    first = road(right=lane(-1, on) + lane(-2, taper), link=link)
    found = lanes(first, road(right=lane(-1), number=2, x=100))

    assert found["1.0.-1"].successors == ("2.0.-1",)
    assert found["1.0.-2"].successors == ()


# --- junctions ---

DIRECT = (
    '<junction id="9" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" '
    'contactPoint="start"><laneLink from="-1" to="-1"/><laneLink from="1" to="1"/>'
    "</connection></junction>"
)


def test_a_direct_junction_joins_roads_both_ways() -> None:
    roads = (
        road(lane(1), lane(-1), link='<successor elementType="junction" elementId="9"/>'),
        road(lane(1), lane(-1), number=2, x=100,
             link='<predecessor elementType="junction" elementId="9"/>'),
    )  # fmt: skip
    found = lanes(*roads, more=DIRECT)

    assert found["1.0.-1"].successors == ("2.0.-1",)
    assert found["2.0.1"].successors == ("1.0.1",)
    assert found["2.0.-1"].successors == found["1.0.1"].successors == ()


def test_a_virtual_junction_is_left_out_and_named() -> None:
    virtual = '<junction id="9" type="virtual"><connection id="0" incomingRoad="1"/></junction>'
    link = '<predecessor elementType="road" elementId="2" elementS="30" elementDir="+"/>'
    network = read_opendrive(text(road(right=lane(-1), link=link), more=virtual), "a.xodr")

    assert network.unused == {"link into a road (elementS)": 1, "virtual junction": 1}


# --- files ---


@pytest.mark.parametrize(
    "before",
    [b"\xef\xbb\xbf", b"\n\n", b"\xef\xbb\xbf\n", b"saved by a tool\n", b"<!-- the\nlicence -->\n"],
)
def test_a_mark_or_text_before_the_declaration_is_skipped(before: bytes) -> None:
    data = text(road(right=lane(-1)))
    assert set(read_opendrive(before + data, "a.xodr").roads) == {"1"}


OBJECTS = (
    '<objects><object id="1"/><object id="2"/><userData/></objects>'
    '<signals><signal id="3"/></signals></road>'
)


@pytest.mark.slow
def test_what_has_no_effect_is_named_and_counted(tmp_path: Path) -> None:
    inner = (
        WIDTH + '<height sOffset="0" inner="0" outer="0"/><height sOffset="9" inner="0" outer="0"/>'
    )
    data = text(road(right=lane(-1, inner + "<material/>"))).replace(b"</road>", OBJECTS.encode())
    (tmp_path / "town.xodr").write_bytes(data)
    told = "not used: 1 height after a lane's first, 1 material of lane, 2 object, 1 signal"
    library = open_library([tmp_path], tmp_path / "cache")

    (finding,) = check_folder(tmp_path, library)

    assert f"{tmp_path / 'town.xodr'}: {told}" in finding.warnings
    assert not finding.error


# --- published maps ---

OFFSET = '<laneOffset s="{}" a="{}" b="0" c="0" d="0"/>'


def with_second_section(text_of_road: str, offsets: str, section: str) -> str:
    """The road with lane offsets, and a second lane section from s = 50 m."""
    whole = text_of_road.replace("<lanes>", f"<lanes>{offsets}")
    center = '<center><lane id="0" type="none"/></center>'
    return whole.replace(
        "</lanes>", f'<laneSection s="50"><left>{section}</left>{center}</laneSection></lanes>'
    )


def test_a_lane_offset_may_jump_where_sections_meet() -> None:
    """As RoadRunner writes it: a lane that is added inside moves the centre, no other lane."""
    more = with_second_section(
        road(left=lane(1, f'<link><successor id="2"/></link>{WIDTH}')),
        OFFSET.format(0, 0) + OFFSET.format(50, -3.5),
        lane(1, kind="none") + lane(2, f'<link><predecessor id="1"/></link>{WIDTH}'),
    )
    found = lanes(more)
    assert found["1.1.2"].successors == ("1.0.1",)
    for name in ("1.0.1", "1.1.2"):
        assert {round(y, 6) for _, y, _ in found[name].center_m} == {1.75}


def test_of_two_records_at_one_place_the_last_one_counts() -> None:
    """Whatever their coefficients, and if they differ by a rounding error."""
    for again in (0, 1e-9):
        offsets = OFFSET.format(again, 5) + OFFSET.format(0, 1)
        moved = road(left=lane(1)).replace("<lanes>", f"<lanes>{offsets}")
        assert {round(y, 6) for _, y, _ in lanes(moved)["1.0.1"].center_m} == {2.75}


def test_sidewalks_that_meet_head_on_lead_nowhere() -> None:
    """Links join sidewalks of either direction, as at the corners of CARLA's towns."""
    link = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    walk = lane(-1, f'<link><successor id="1"/></link>{WIDTH}', kind="sidewalk")
    corner = road(left=lane(1, kind="sidewalk"), number=2, x=100)
    corner = corner.replace("<lanes>", f"<lanes>{OFFSET.format(0, -3.5)}")
    found = lanes(road(right=walk, link=link), corner)
    assert found["1.0.-1"].center_m[-1] == found["2.0.1"].center_m[-1]
    assert found["1.0.-1"].successors == ()


@pytest.mark.parametrize("rule", ["RHT", "LHT"])
def test_borders_follow_lanes_that_widen_shift_and_twist(rule: str) -> None:
    """Closed forms of the file: a taper next to an offset, on a superelevation that grows.

    At s the offset is 0.02 s, the width 1 + 0.02 s, and the road is rolled by 0.0005 s.
    """
    wide = '<width sOffset="0" a="1" b="0.02" c="0" d="0"/>'
    twist = '<superelevation s="0" a="0" b="0.0005" c="0" d="0"/>'
    made = road(lane(1), lane(-1, wide) + lane(-2), twist)
    made = made.replace("<lanes>", '<lanes><laneOffset s="0" a="0" b="0.02" c="0" d="0"/>')
    named = lanes(made.replace("<road ", f'<road rule="{rule}" '))
    for name, is_upper, slope, middle_m in (
        ("1.0.1", True, 0.02, 3.5),
        ("1.0.1", False, 0.02, 0.0),
        ("1.0.-1", True, 0.02, 0.0),
        ("1.0.-1", False, 0.0, -1.0),
        ("1.0.-2", True, 0.0, -1.0),
        ("1.0.-2", False, 0.0, -4.5),
    ):
        one = named[name]
        runs_east = one.center_m[0][0] < one.center_m[-1][0]
        assert runs_east == ((name == "1.0.1") == (rule == "LHT"))
        line = np.array(border_line(one, "left" if is_upper == runs_east else "right"))
        s = line[:, 0] + 50.0
        t = slope * s + middle_m
        assert line[:, 1] == pytest.approx(t * np.cos(0.0005 * s), abs=2e-3)
        assert line[:, 2] == pytest.approx(t * np.sin(0.0005 * s), abs=2e-3)


def test_borders_and_surface_bend_where_a_record_begins() -> None:
    """A lane of 3 m widens from 33.1 m on by 0.1 per metre, to 5 m at 53.1 m."""
    records = ((0, 3, 0), (33.1, 3, 0.1), (53.1, 5, 0))
    widths = "".join(f'<width sOffset="{s}" a="{a}" b="{b}" c="0" d="0"/>' for s, a, b in records)
    made = road(right=lane(-1, widths + SOLID))
    line = np.array(border_line(lanes(made)["1.0.-1"], "right"))

    outer_m = np.interp(line[:, 0] + 50.0, [33.1, 53.1], [-3.0, -5.0])
    assert line[:, 1] == pytest.approx(outer_m, abs=0.01)
    asphalt = network_solid(read_opendrive(text(made), "a.xodr")).mesh.vertices_m[:, :2]
    corners = np.round(asphalt.astype(float), 4).tolist()
    assert {(-16.9, -3.0), (3.1, -5.0)} <= set(map(tuple, corners))


def tapered(*widths: tuple[float, float, float]) -> str:
    return "".join(f'<width sOffset="{s}" a="{a}" b="{b}" c="0" d="0"/>' for s, a, b in widths)


def border_spans(found: dict[str, Lane]) -> set[tuple[str, str, int, int]]:
    """Borders: name, kind, and where they begin and end along the road, in whole metres."""
    spans: set[tuple[str, str, int, int]] = set()
    for border in lane_borders(tuple(found.values())):
        low, high = sorted(round(border.points_m[k][0] + 50.0) for k in (0, -1))
        spans.add((border.name, border.kind, low, high))
    return spans


def test_a_lane_without_width_has_one_border() -> None:
    """A lane of no width up to 40 m, which is 3 m wide from 70 m on, outside and inside another.

    At stations of 2 m it is 0.2 m wide at 42 m and 0.4 m at 44 m.
    """
    opens = tapered((0, 0, 0), (40, 0, 0.1), (70, 3, 0))
    outside = lanes(road(right=lane(-1) + lane(-2, opens)))
    assert border_spans(outside) == {
        ("1.0.-1:left", "edge", 0, 100),
        ("1.0.-2:left", "lane", 42, 100),
        ("1.0.-2:right", "edge", 0, 100),
    }
    inside = lanes(road(right=lane(-1, opens) + lane(-2)))
    assert border_spans(inside) == {
        ("1.0.-1:left", "edge", 0, 100),
        ("1.0.-2:left", "lane", 42, 100),
        ("1.0.-2:right", "edge", 0, 100),
    }
    outline = lane_area([outside["1.0.-2"]]).exterior
    assert len(np.unique(outline.round(6), axis=0)) == len(outline) - 1  # closed at its tip
    following = np.roll(outline, -1, axis=0)
    twice_m2 = (outline[:, 0] * following[:, 1] - outline[:, 1] * following[:, 0]).sum()
    assert abs(twice_m2) / 2 == pytest.approx(30 * 3 / 2 + 30 * 3, abs=0.1)


def test_lanes_without_width_anywhere_are_left_out() -> None:
    """The lanes on both sides of it are neighbours."""
    found = lanes(road(right=lane(-1) + lane(-2, tapered((0, 0, 0))) + lane(-3)))
    assert {"1.0.-1", "1.0.-3"} == {name for name in found if found[name].kind == "driving"}
    assert (found["1.0.-1"].right, found["1.0.-3"].left) == ("1.0.-3", "1.0.-1")
