"""Written text: ink that rays of Embree find is in the quads, and hidden where they miss it."""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.text import CAPITALS_PX, LETTERS_PX, Text
from gen_data.assets.asset_ids import parse_asset_id
from gen_data.assets.drape import draped_id
from gen_data.assets.families import known_families
from gen_data.assets.family import TextureFamily
from gen_data.content.procedural.textures import artwork as art
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.motion import Trajectory
from gen_data.core.sample import ImageTruth, TextTruth, WordTruth
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.core.serialization import canonical_json
from gen_data.core.shutter import Shutter
from gen_data.core.writing import Writing, recording
from tests.assets.test_draped_meshes import HILL, PLACE
from tests.embree import RayCaster, placed
from tests.libraries import library
from tests.renderers.fake_library import FakeLibrary, box_mesh
from tests.survival import assert_survives

SHEET_PX = (2048, 1024)
PRINT = Material(texture="texture/print")
BENT_LENS = Lens("brown_conrady", (-0.25, 0.06, 0.001, -0.001, 0.0, 0.0, 0.0, 0.0))
TWO_LINES = "Rue du Port", "A-12 g"


@cache
def printed() -> tuple[NDArray[np.bool_], tuple[Writing, ...]]:
    """Ink of a sheet with two lines, row 0 at its top, and the lines."""
    image = art.canvas(*SHEET_PX, (255, 255, 255))
    with recording() as lines:
        art.text(image, (0.1, 0.1, 0.9, 0.45), TWO_LINES[0], (0, 0, 0), 2)
        art.lettering(image, (0.25, 0.55, 0.75, 0.85), TWO_LINES[1], (0, 0, 0), "serif", 4)
        art.record(image)
    return np.array(image)[..., 0] < 128, tuple(lines)


def surface(points: Any, u: Any, v: Any) -> MeshData:
    """Points [rows, columns, 3] from the top down as a printed sheet, read from its outside."""
    rows, columns = points.shape[:2]
    ids = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
    uvs = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), -1).reshape(-1, 2)
    return MeshData(
        points.reshape(-1, 3).astype(np.float32), faces.astype(np.int32),
        np.zeros((rows * columns, 3), np.float32), uvs.astype(np.float32),
        np.zeros(len(faces), np.int32), (PRINT,),
    )  # fmt: skip


def flat(u: tuple[float, float] = (0.0, 1.0), step: int = 2) -> MeshData:
    """A sheet 0.4 m wide in the plane X = 0, read from +X, where Y points to the right."""
    shares, rows = np.linspace(*u, step), np.array((1.0, 0.0))
    y, z = 0.4 * (shares - 0.5), 0.2 * (rows - 0.5)
    points = np.stack(np.broadcast_arrays(0.0, y[None, :], z[:, None]), -1)
    return surface(points, shares, rows)


def drum(radius_m: float = 0.09) -> MeshData:
    """The same sheet around a cylinder about Z, its middle at +X."""
    shares, rows = np.linspace(0.0, 1.0, 65), np.array((1.0, 0.0))
    turn = 0.4 / radius_m * (shares - 0.5)
    x, y = radius_m * np.cos(turn), radius_m * np.sin(turn)
    z = 0.2 * (rows - 0.5)
    return surface(np.stack(np.broadcast_arrays(x, y, z[:, None]), -1), shares, rows)


class Printed(FakeLibrary):
    """A library whose texture ``texture/print`` is the sheet of ``printed``."""

    def writing(self, texture_id: str) -> tuple[Writing, ...]:
        return printed()[1] if texture_id == PRINT.texture else ()


ASSETS = Printed({"flat": flat(), "fine": flat(step=41), "drum": drum(), "box": box_mesh(),
                  "cut": flat((0.0, 0.5)), "tiled": flat((0.0, 2.0))})  # fmt: skip
BLOCK = Body("block", "box", SE3((0.15, 0.06, 0.03)), scale=0.05, instance_id=2)


def camera(distance_m: float, *, side: float = 0.35, lens: Lens = BENT_LENS) -> Camera:
    """A camera that looks at the origin from +X, from aside and above."""
    eye = (distance_m, side * distance_m, 0.3 * distance_m)
    return Camera("color", look_at(eye, (0.0, 0.0, 0.0)),
                  Intrinsics(640, 480, 700.0, 700.0, 320.0, 240.0, lens))  # fmt: skip


@dataclass
class Seen:
    """An image by Embree: ids, numbers of bodies and whether a pixel shows ink."""

    truth: tuple[TextTruth, ...]
    body: NDArray[np.int32]
    ink: NDArray[np.bool_] = field(repr=False)


def look(asset: str, view: Camera, *others: Body, **fields: float) -> Seen:
    """A sheet at the origin, with its ink."""
    seen, points_m, face = cast(
        ASSETS, view, Body("print", asset, instance_id=1), *others, **fields
    )
    own = seen.body == 0
    seen.ink[own] = inked(ASSETS.mesh(asset), face[own], points_m[own])
    return seen


def cast(
    assets: Any, view: Camera, *bodies: Body, **fields: float
) -> tuple[Seen, NDArray[np.float64], NDArray[np.int32]]:
    """An image without ink; places on rays, and faces that they hit."""
    scene = Scene("s", bodies=bodies, cameras=(view,))
    rays = view.T_world_camera.rotate(view.intrinsics.pixel_rays())
    eye = np.array(view.T_world_camera.translation_m)
    hits = RayCaster(*(placed(body, assets) for body in bodies)).cast(eye, rays)
    ids = np.array([0, *(body.instance_id for body in bodies)], np.uint16)[hits.mesh + 1]
    length = np.linalg.norm(rays, axis=-1)
    channels = {Channel.INSTANCE: ids, Channel.RANGE: (hits.distance * length).astype(np.float32)}
    reading = SensorReading("color", view, channels)
    truth = Text(**fields).annotate_image(scene, assets, reading, ImageTruth(view, ()))
    assert truth.texts is not None
    points_m = eye + rays * hits.distance[..., None]
    return Seen(truth.texts, hits.mesh, np.zeros(ids.shape, np.bool_)), points_m, hits.face


def uvs_at(mesh: MeshData, face: Any, points_m: Any) -> NDArray[np.float64]:
    """UVs [n, 2] at points [n, 3] on triangles [n]."""
    known, number = np.unique(face, return_inverse=True)
    corners = mesh.vertices_m[mesh.faces[known]].astype(np.float64)
    edges = np.linalg.pinv(
        np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], -1)
    )
    two = np.einsum("nij,nj->ni", edges[number], points_m - corners[number, 0])
    weights = np.column_stack([1.0 - two.sum(axis=1), two])
    return np.asarray(np.einsum("nk,nki->ni", weights, mesh.uvs[mesh.faces[face]].astype(float)))


def inked(mesh: MeshData, face: Any, points_m: Any) -> NDArray[np.bool_]:
    """Whether points [n, 3] on triangles [n] show ink."""
    u, v = uvs_at(mesh, face, points_m).T
    columns = np.floor(u % 1.0 * SHEET_PX[0]).astype(int).clip(0, SHEET_PX[0] - 1)
    rows = np.floor((1.0 - v % 1.0) * SHEET_PX[1]).astype(int).clip(0, SHEET_PX[1] - 1)
    return np.asarray(printed()[0][rows, columns])


def to_sides(quad: Any, points: Any) -> Any:
    """Signed distances [n, 4] of points [n, 2] to the sides of a quad, inside positive [px]."""
    start = np.asarray(quad)
    along = np.roll(start, -1, axis=0) - start
    normal = np.stack([-along[:, 1], along[:, 0]], -1) / np.linalg.norm(along, axis=1)[:, None]
    return ((points[:, None] - start) * normal).sum(axis=2)


def characters(seen: Seen) -> list[Any]:
    return [c for text in seen.truth for word in text.words for c in word.characters]


def words(seen: Seen) -> list[WordTruth]:
    return [word for text in seen.truth for word in text.words]


@pytest.mark.parametrize("asset", ["flat", "fine", "drum"])
def test_ink_lies_in_the_quads_of_characters_and_touches_their_sides(asset: str) -> None:
    """Through a distorting lens, to less than a pixel, and to the chord of a character if bent."""
    slack_px = 2.0 if asset == "drum" else 0.75
    seen = look(asset, camera(0.55))
    assert [text.text for text in seen.truth] == list(TWO_LINES)
    centres = np.argwhere(seen.ink)[:, ::-1] + 0.5
    covered = np.zeros(len(centres), np.bool_)
    for character in characters(seen):
        if character.visible_fraction == 1.0:
            gaps = to_sides(character.quad_px, centres)
            inside = (gaps > -slack_px).all(axis=1)
            assert np.abs(gaps[inside].min(axis=0)).max() < slack_px + 0.75, character.text
            covered |= inside
        else:
            covered |= (to_sides(character.quad_px, centres) > -2.5).all(axis=1)
    assert covered.mean() > 0.999 and len(centres) > 3000
    if asset != "drum":
        assert all(c.visible_fraction == 1.0 for c in characters(seen))
        # Also words and lines, but for the curvature of the lens.
        for word in words(seen):
            assert (to_sides(word.quad_px, np.array(word.characters[0].quad_px)) > -1.5).all()


def test_characters_are_in_reading_order_from_the_top_left_clockwise() -> None:
    seen = look("flat", camera(0.5, side=0.0))
    for text, expected in zip(seen.truth, TWO_LINES, strict=True):
        assert " ".join(w.text for w in text.words) == expected
        for word in text.words:
            assert "".join(c.text for c in word.characters) == word.text
            (x0, y0), (x1, y1), (x2, y2), (x3, y3) = word.quad_px
            assert x0 < x1 and x3 < x2 and y0 < y3 and y1 < y2
            lefts = [c.quad_px[0][0] for c in word.characters]
            assert lefts == sorted(lefts)
    assert [t.language for t in seen.truth] == ["fr", "zxx"]


def test_visible_shares_are_those_of_pixels_by_rays() -> None:
    """A block hides some characters, the curvature of the drum others."""
    some = 0
    for name, others in (("drum", ()), ("flat", (BLOCK,)), ("drum", (BLOCK,))):
        seen = look(name, camera(0.5), *others)
        for word in words(seen):
            quads = np.array([c.quad_px for c in word.characters])
            shown, hidden = coverage(seen.body, quads), word.visible_fraction
            if shown is not None:
                assert hidden == pytest.approx(shown, abs=0.06), word.text
                some += 0.1 < shown < 0.95
        text = seen.truth[0]
        assert text.visible_fraction < 1.0
        assert text.instance_id == 1 and text.body == "print"
    assert some >= 3, "some words are partly hidden"


def coverage(body: Any, quads: Any) -> float | None:
    """Share of the pixels in some quads that show the print; None where one is seen edge-on."""
    inside = np.zeros(body.shape, np.uint8)
    for quad in quads:
        area = cv2.contourArea(quad.astype(np.float32), oriented=True)
        if area < 60.0:
            return None
        one = np.zeros_like(inside)
        cv2.fillPoly(one, [np.rint((quad - 0.5) * 16.0).astype(np.int32)], 1, shift=4)
        inside |= one
    return float((body[inside > 0] == 0).mean())


def test_text_is_readable_from_the_size_of_the_standard_on_and_if_half_of_each_letter_shows() -> (
    None
):
    """ISO 9241-303: 7 px for digits and capitals, 9 px for letters of both cases."""
    for distance_m in (1.0, 2.6, 4.0, 7.0):
        for word in words(look("flat", camera(float(distance_m), side=0.0), min_height_px=0.5)):
            least = CAPITALS_PX if word.text in ("A-12",) else LETTERS_PX
            # Seen from above, heights are shortened more than widths.
            assert word.readable == (word.height_px >= least), word
    high = words(look("flat", camera(1.5, side=0.0)))[0]
    tops = [np.subtract(c.quad_px[3], c.quad_px[0]) for c in high.characters]
    assert high.height_px == pytest.approx(max(np.linalg.norm(t) for t in tops), rel=0.03)
    aside = words(look("flat", camera(1.5, side=6.0), min_height_px=0.5))
    assert not any(word.readable for word in aside)
    hidden = words(look("flat", camera(0.5), BLOCK))
    assert any(word.visible_fraction > 0.0 and not word.readable for word in hidden)


def test_strokes_have_the_width_of_the_ink() -> None:
    """Runs of ink across the l-shaped strokes of a line in plain letters."""
    seen = look("flat", camera(0.5, side=0.0))
    word = next(w for w in words(seen) if w.text == "du")
    d = np.array(word.characters[0].quad_px)
    rows = range(int(d[:, 1].min()) + 3, int(d[:, 1].min()) + 9)
    runs = [
        int(seen.ink[row, int(d[:, 0].min()) - 1 : int(d[:, 0].max()) + 1].sum()) for row in rows
    ]
    assert word.stroke_px == pytest.approx(float(np.median(runs)), abs=1.5)


def test_text_is_listed_once_per_place_and_cut_where_the_surface_ends() -> None:
    """A sheet with two repetitions, and one with the left half only; backs have none."""
    assert [t.text for t in look("tiled", camera(1.0, side=0.0)).truth] == [
        line for line in TWO_LINES for _ in range(2)
    ]
    cut = look("cut", camera(0.5, side=0.0)).truth
    assert [t.complete for t in cut] == [False, False]
    assert all(t.text and line.startswith(t.text) for t, line in zip(cut, TWO_LINES, strict=True))
    behind = replace(camera(0.5), T_world_camera=look_at((-0.5, 0.1, 0.1), (0.0, 0.0, 0.0)))
    assert look("flat", behind).truth == ()


def test_a_code_has_the_content_and_corners_that_a_detector_finds() -> None:
    """OpenCV's, in an image of the inked faces; its corners are pixel centres."""
    view, body = camera(0.4, side=0.2), Body("code", "qr_code?seed=3&side_m=0.15", instance_id=1)
    body = replace(body, T_world_body=SE3((0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5)))
    seen, _, face = cast(library(), view, body)
    (text,) = seen.truth
    mesh = library().mesh(body.asset)
    image = np.where((seen.body == 0) & (mesh.face_slots[face] == 1), 0, 255).astype(np.uint8)
    content, corners, _ = cv2.QRCodeDetector().detectAndDecode(image)
    assert text.text == content == dict(library().get(body.asset).attributes)["text"]
    assert text.kind == "code" and text.language == "zxx" and text.words[0].readable
    gaps = np.abs(np.array(text.quad_px) - 0.5 - corners[0]).max(axis=1)
    # The lower right corner has no pattern: detectors extend the sides.
    assert (gaps < (1.2, 1.2, 3.0, 1.2)).all()
    side_px = np.linalg.norm(np.subtract(text.quad_px[0], text.quad_px[3]))
    assert text.words[0].stroke_px == pytest.approx(side_px / 21.0, rel=0.06)
    far = cast(library(), replace(view, T_world_camera=look_at((2.5, 0.3, 0.2), (0, 0, 0))), body)
    assert not far[0].truth[0].words[0].readable
    cut = replace(view, intrinsics=replace(view.intrinsics, cy_px=0.0))
    assert not cast(library(), cut, body)[0].truth[0].words[0].readable


@pytest.mark.parametrize("ground", ["level", "hill"])
def test_words_on_roads_have_the_letters_that_rays_meet(ground: str) -> None:
    """On level ground and on a hill: paint is in the quads and touches their sides."""
    asset, road = "road_marking?sign=word&text=_BUS", "road"
    if ground == "hill":
        asset, road = (draped_id(parse_asset_id(a), PLACE, 1.0, HILL) for a in (asset, road))
    bounds = np.array(library().bounds_m(asset))
    middle = bounds.mean(axis=0)
    eye = middle + np.array((-6.0, 1.0, 4.0))
    lens = Intrinsics(640, 480, 500.0, 500.0, 320.0, 240.0, BENT_LENS)
    view = Camera("color", look_at(tuple(eye), tuple(middle)), lens)
    seen, _, _ = cast(library(), view, Body("word", asset), Body("road", road))
    (text,) = seen.truth
    assert text.text == "BUS" and text.words[0].readable and text.instance_id == 0
    paint = np.argwhere(seen.body == 0)[:, ::-1] + 0.5
    covered = np.zeros(len(paint), np.bool_)
    for character in text.words[0].characters:
        gaps = to_sides(character.quad_px, paint)
        inside = (gaps > -1.0).all(axis=1)
        assert np.abs(gaps[inside].min(axis=0)).max() < 1.75
        assert character.visible_fraction == 1.0
        covered |= inside
    assert covered.all()


@pytest.mark.parametrize(
    ("asset", "eye"),
    [("book?seed=3", (0.1, -0.1, 0.4)), ("can?seed=5", (0.3, 0.05, 0.1)),
     ("mug?seed=44", (0.0, 0.35, 0.05)), ("street_name_plate?seed=1", (1.5, 0.4, 2.6)),
     ("traffic_sign?seed=0&sign=stop", (2.0, 0.3, 2.0)), ("car?seed=2", (4.0, 0.4, 0.4)),
     ("keyboard?seed=2", (0.05, -0.2, 0.4))],
)  # fmt: skip
def test_the_ray_through_a_character_meets_the_texture_where_it_is_drawn(
    asset: str, eye: tuple[float, float, float]
) -> None:
    """On assets of the library; by the UVs of the triangle that Embree finds."""
    bounds = np.array(library().bounds_m(asset))
    aim = (0.0, 0.0, float(bounds[:, 2].mean()))
    if asset.startswith(("traffic", "street")):
        aim = (0.0, 0.0, float(bounds[1, 2]) - 0.3)
    view = Camera(
        "color", look_at(eye, aim), Intrinsics(640, 480, 600.0, 600.0, 320.0, 240.0, BENT_LENS)
    )
    seen, _, _ = cast(library(), view, Body("thing", asset, instance_id=1), min_height_px=3.0)
    assert seen.truth
    mesh, checked = library().mesh(asset), 0
    origin = np.array(view.T_world_camera.translation_m)
    for text in seen.truth:
        for word in text.words:
            shown = [
                c for c in word.characters if c.visible_fraction == 1.0 and least_side(c) > 2.0
            ]
            if not shown:
                continue
            centres = np.array([np.mean(c.quad_px, axis=0) for c in shown])
            rays = view.T_world_camera.rotate(view.intrinsics.rays(centres))
            hits = RayCaster(placed(Body("thing", asset), library())).cast(origin, rays)
            points_m = origin + rays * hits.distance[..., None]
            for uv, face, character in zip(
                uvs_at(mesh, hits.face, points_m), hits.face, shown, strict=True
            ):
                texture = mesh.materials[mesh.face_slots[face]].texture
                assert any(
                    is_there(line, character.text, uv) for line in library().writing(texture)
                )
                checked += 1
    assert checked >= 2


def least_side(character: Any) -> float:
    quad = np.array(character.quad_px)
    return float(np.linalg.norm(np.roll(quad, -1, axis=0) - quad, axis=1).min())


def is_there(line: Writing, letter: str, uv: Any) -> bool:
    """Whether a line has a letter in the middle of which is a place, to a quarter of its size."""
    letters = [c for c in line.text if not c.isspace()]
    x, y = uv[0] % 1.0, (1.0 - uv[1]) % 1.0
    for own, quad in zip(letters, line.quads, strict=False):
        size = np.ptp(quad, axis=0)
        if own == letter and (np.abs(quad.mean(axis=0) - (x, y)) < 0.25 * size + 2e-3).all():
            return True
    return False


@pytest.mark.parametrize("readout_s", [0.0, 0.03, -0.03])
def test_text_that_moves_is_where_the_rows_of_a_rolling_shutter_show_it(readout_s: float) -> None:
    """A sheet 2 m away that moves to the right by 350 px/s: each corner by its row's delay."""
    lens = Intrinsics(640, 480, 700.0, 700.0, 320.0, 240.0)
    view = Camera("color", look_at((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), lens,
                  shutter=Shutter(0.0, readout_s))  # fmt: skip
    way = tuple(SE3((0.0, y, 0.0)) for y in (-1.0, 0.0, 1.0))
    scene = Scene("s", bodies=(Body("print", "flat", instance_id=1),), cameras=(view,),
                  tracks=(Trajectory("print", 1.0, way, -1.0),))  # fmt: skip
    shape = (480, 640)
    channels = {Channel.INSTANCE: np.ones(shape, np.uint16),
                Channel.RANGE: (2.0 / lens.pixel_rays()[..., 2]).astype(np.float32)}  # fmt: skip
    reading = SensorReading("color", view, channels)
    texts = Text().annotate_image(scene, ASSETS, reading, ImageTruth(view, ())).texts or ()
    assert [t.visible_fraction for t in texts] == [1.0, 1.0]
    for text, line in zip(texts, printed()[1], strict=True):
        letters = [c for word in text.words for c in word.characters]
        for character, shares in zip(letters, line.quads, strict=True):
            v = 240.0 + 350.0 * 0.2 * (shares[:, 1] - 0.5)
            u = 320.0 + 350.0 * (0.4 * (shares[:, 0] - 0.5) + readout_s * (v / 480.0 - 0.5))
            np.testing.assert_allclose(character.quad_px, np.stack([u, v], axis=1), atol=0.01)


def test_a_plate_has_its_text_once_though_its_edges_show_the_texture_too() -> None:
    """In front and behind, and nothing on the edges of the plates, 6 cm thick."""
    view = Camera("color", look_at((5.3, 2.5, 1.2), (2.3, 0.0, 0.5)),
                  Intrinsics(640, 480, 2000.0, 2000.0, 320.0, 240.0))  # fmt: skip
    seen, _, _ = cast(library(), view, Body("car", "car?seed=2", instance_id=1))
    assert [t.text for t in seen.truth if len(t.text) > 2] == ["AR SD 786"]


def test_annotations_survive_being_stored() -> None:
    truth = ImageTruth(camera(0.5), (), texts=look("flat", camera(0.5)).truth)
    assert_survives(truth)
    assert "texts" not in canonical_json(ImageTruth(camera(0.5), ()))


@pytest.mark.slow
def test_families_of_textures_declare_whether_they_write() -> None:
    """Families that record text for one of four seeds do; the others of them for one of twenty."""
    for name, family in known_families().items():
        if isinstance(family, TextureFamily):
            declared = bool(family.declares.get("writing"))
            found = False
            for seed in range(20 if declared else 4):
                with recording() as lines:
                    family.build(seed=seed, **family.parameters)
                found = found or bool(lines)
                if found:
                    break
            kinds = "kind" in family.parameters
            assert declared == found or (declared and kinds), name
