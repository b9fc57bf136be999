"""Parts of the page without a browser: the queue, the guard, the session, small cameras."""

from __future__ import annotations

import ast
import asyncio
import errno
import os
import re
import socket
from collections.abc import MutableMapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.config.distributions import Uniform, UniformInteger
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.streams import Streams
from gen_data.lab.edit import data_sets, own_files, server
from gen_data.lab.edit.desk import Pictures
from gen_data.lab.edit.files import ChangedError, Folders, OpenedFile, read_file
from gen_data.lab.edit.reuse import Memory
from gen_data.lab.edit.samples import Check, Labelled, Shown, Studio, shrink
from gen_data.lab.edit.server import COOKIE, Guard, free_port, usual_port
from gen_data.lab.edit.session import Session, vary
from gen_data.lab.edit.statistics import rows, summarise
from gen_data.lab.edit.workers import Queue, Ready, Refused, Ticket
from gen_data.randomizers.lighting import Lighting
from gen_data.report.drawn_parameters import Draw, observe_randomizer

SHOWN = Shown(
    b"jpeg",
    5,
    {"color": "photo"},
    (Labelled("cup", 10, 20, 0.5), Labelled("Cup", 30, 40, None)),
    {"orbit.distance_m": (1.2,), "orbit.roll_deg": (3.0,), "lamps.count": (2,), "orbit.at": (1, 2)},
    0.25,
    5,
    1,
)


def test_results_are_known_by_the_same_object_and_settings() -> None:
    """Not by an equal one; the oldest go first, and errors are not kept."""
    memory, made = Memory(limit=2), iter(range(9))
    one, equal = [1], [1]
    assert [memory.get(one, "a", lambda: next(made)) for _ in range(2)] == [0, 0]
    assert memory.get(equal, "a", lambda: next(made)) == 1
    assert memory.get(one, "a", lambda: next(made)) == 0
    assert memory.get(one, "b", lambda: next(made)) == 2
    assert memory.get(equal, "a", lambda: next(made)) == 3
    with pytest.raises(ZeroDivisionError):
        memory.get(one, "c", lambda: 1 / 0)
    assert memory.get(one, "c", lambda: next(made)) == 4


def tickets(client: str, count: int) -> list[Ticket]:
    return [Ticket(client, slot, Ready()) for slot in range(count)]


def test_newer_jobs_replace_those_that_wait() -> None:
    """Running jobs become outdated, too; their results reach nobody."""
    queue = Queue()
    queue.replace("a", tickets("a", 3))
    running = queue.take()
    assert running is not None
    newer = [replace(ticket, slot=ticket.slot + 10) for ticket in tickets("a", 2)]
    queue.replace("a", newer)
    assert not queue.is_current(running)
    assert [queue.take(), queue.take(), queue.take()] == [*newer, None]
    assert queue.is_current(newer[0])
    queue.replace("a", [])
    assert not queue.is_current(newer[0])


def test_tabs_take_turns() -> None:
    """A tab with many pictures does not hold up another one."""
    queue = Queue()
    queue.replace("a", tickets("a", 3))
    queue.replace("b", tickets("b", 2))
    order = [ticket.client for ticket in iter(queue.take, None)]
    assert order == ["a", "b", "a", "b", "a"]


def test_a_check_waits_for_the_pictures_of_all_tabs() -> None:
    """Also for pictures ordered after it; a tab that is forgotten may order at once again."""
    queue = Queue()
    queue.replace("a/check", tickets("a/check", 1), later=True)
    queue.replace("a", tickets("a", 2))
    queue.replace("b", tickets("b", 1))
    order = [ticket.client for ticket in iter(queue.take, None)]
    assert order == ["a", "b", "a", "a/check"]
    queue.replace("a/check", [])
    queue.replace("a/check", tickets("a/check", 1))
    queue.replace("a", tickets("a", 1))
    assert [ticket.client for ticket in iter(queue.take, None)] == ["a/check", "a"]


def test_a_job_whose_process_crashed_comes_first_again() -> None:
    """It stays current under its new ticket."""
    queue = Queue()
    queue.replace("a", tickets("a", 2))
    crashed = queue.take()
    assert crashed is not None
    again = replace(crashed, tries=1)
    queue.put_back(crashed, again)
    assert queue.take() == again
    assert queue.is_current(again)
    assert not queue.is_current(crashed)


def ask(
    kind: str,
    query: str = "",
    hosts: frozenset[str] = frozenset({"127.0.0.1:80"}),
    **headers: str,
) -> tuple[list[MutableMapping[str, Any]], bool]:
    """Messages that a guard sends for a request, and whether the request has reached the page."""
    reached: list[bool] = []
    sent: list[MutableMapping[str, Any]] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        reached.append(True)

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(message)

    async def receive() -> MutableMapping[str, Any]:
        return {}

    scope = {
        "type": kind,
        "path": "/",
        "query_string": query.encode(),
        "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
    }
    guard = Guard(app, "secret", hosts, 80)
    asyncio.run(guard(scope, receive, send))
    return sent, bool(reached)


def test_a_request_needs_the_token_and_a_host_of_this_machine() -> None:
    """The token of the printed address becomes a cookie; other sites and names are refused."""
    ours = {"host": "127.0.0.1:80"}
    cookie = {"cookie": f"{COOKIE}_80=secret"}
    sent, reached = ask("http", "token=secret", **ours)
    assert (sent[0]["status"], reached) == (303, False)
    assert dict(sent[0]["headers"])[b"set-cookie"].startswith(
        b"gen_data_edit_80=secret; HttpOnly; SameSite"
    )
    assert ask("http", **ours, **cookie)[1]
    assert ask("websocket", **ours, **cookie, origin="http://127.0.0.1:80")[1]
    for headers in (
        ours,
        {**ours, "cookie": f"{COOKIE}_80=guess"},
        {"host": "evil.example:80", **cookie},
        {**ours, **cookie, "origin": "http://evil.example"},
    ):
        sent, reached = ask("http", **headers)
        assert (sent[0]["status"], reached) == (403, False)
        sent, reached = ask("websocket", **headers)
        assert (sent, reached) == ([{"type": "websocket.close", "code": 1008}], False)
    assert not ask("http", "token=guess", **ours)[1]


def test_pictures_are_bounded_by_their_bytes() -> None:
    """The oldest go first; the newest stays, whatever its size."""
    pictures = Pictures(limit_bytes=10)
    first, second = pictures.put(b"12345"), pictures.put(b"12345")
    third = pictures.put(b"1")
    assert [f"/edit/picture/{name}" for name in pictures.held] == [second, third]
    assert first not in pictures.held
    large = pictures.put(bytes(99))
    assert [f"/edit/picture/{name}" for name in pictures.held] == [large]


@pytest.mark.parametrize("lens", [Lens("pinhole"), Lens("kannala_brandt", (0.01, 0.0, 0.0, 0.0))])
def test_a_smaller_camera_sees_the_same(lens: Lens) -> None:
    """Every direction has its image at the same share of width and height."""
    camera = Intrinsics(640, 480, 500.0, 510.0, 300.0, 250.0, lens)
    small = shrink(camera, 200)
    assert (small.width_px, small.height_px) == (200, 150)
    points = np.array([[0.1, 0.2, 1.0], [-0.3, 0.0, 2.0]])
    shares = camera.project(points) / (640, 480)
    np.testing.assert_allclose(small.project(points) / (200, 150), shares, rtol=1e-12)


def make_session(tmp_path: Path, text: str) -> Session:
    session = Session(OpenedFile(tmp_path / "a.yaml", text), Folders((tmp_path,)))
    session.set_text(text)
    return session


def test_pictures_stay_until_newer_ones_come(tmp_path: Path) -> None:
    """A text with a fault orders none, and marks shown pictures as outdated."""
    session = make_session(tmp_path, "extends: tabletop.yaml\n")
    orders = session.orders()
    assert [order.index for order in orders] == [0, 5, 10, 15, 20, 25, 30, 35]
    session.accept(Ticket("a", 0, orders[0]), SHOWN)
    assert (session.shown, session.outdated) == ([SHOWN], set())
    session.set_text("extends: tabletop.yaml\nseed: x\n")
    assert session.orders() == []
    assert (session.shown, session.outdated) == ([], {0})
    assert session.results == {0: SHOWN}
    assert session.config is not None
    assert [fault.line for fault in session.faults] == [2]


def test_a_fault_of_another_scene_is_found_after_the_pictures_are_ordered(tmp_path: Path) -> None:
    """The first scene draws a valid value; the check of all others names the one that is not."""
    text = (
        "extends: tabletop.yaml\n"
        "shared: {turn_deg: {choice: [400, 20]}}\n"
        "sensors: {color: {yaw_deg: $shared.turn_deg}}\n"
    )
    session = make_session(tmp_path, text)
    check = Check(text, session.name)
    assert session.orders()
    assert session.faults == ()
    session.accept_check(replace(check, text="seed: 1\n"), check.run(Studio()))
    assert session.faults == ()
    session.accept_check(check, check.run(Studio()))
    assert [fault.line for fault in session.faults] == [3]
    assert session.orders() == []


def test_faults_of_scenes_are_faults_of_the_text(tmp_path: Path) -> None:
    """Each once, with its place if it has one."""
    session = make_session(tmp_path, "extends: tabletop.yaml\n")
    for slot, order in enumerate(session.orders()[:2]):
        session.accept(Ticket("a", slot, order), Refused(f"{session.name}:1:10: a: is wrong"))
    assert [(fault.line, fault.column) for fault in session.faults] == [(1, 10)]


def test_one_field_varies_and_all_other_draws_stay(tmp_path: Path) -> None:
    """A drawn field is pinned, a constant one overridden; single numbers of the item are kept."""
    session = make_session(tmp_path, "extends: tabletop.yaml\n")
    varied = vary(SHOWN, "randomizers", "orbit", "distance_m", (0.9, 1.2))
    session.grid = replace(session.grid, variation=varied)
    kept = ("orbit.roll_deg", 3.0)
    assert [(order.index, order.overrides, order.pinned) for order in session.orders()] == [
        (5, (), (kept, ("orbit.distance_m", 0.9))),
        (5, (), (kept, ("orbit.distance_m", 1.2))),
    ]
    varied = vary(SHOWN, "randomizers", "orbit", "jitter_m", (0.1,))
    session.grid = replace(session.grid, variation=varied)
    (order,) = session.orders()
    assert order.overrides == ("randomizers.orbit.jitter_m=0.1",)
    assert order.pinned == (("orbit.distance_m", 1.2), kept)


def test_a_pinned_draw_takes_its_random_numbers() -> None:
    """Those after it are drawn as without the pin, and the log has the pinned value."""
    lamp = Lighting(name="lamps", count=UniformInteger(1, 3), temperature_k=Uniform(2700, 6500))
    logs: list[list[Draw]] = [[], []]
    for log, pinned in zip(logs, ({}, {"lamps.count": 9}), strict=True):
        observed: Any = observe_randomizer(lamp, log, pinned)
        rng = Streams(0, 0).rng("randomizer/lamps")
        assert observed.count.draw(rng) == log[0][2]
        observed.temperature_k.draw(rng)
    assert logs[1][0][2] == 9 != logs[0][0][2]
    assert logs[0][1][2] == logs[1][1][2]


def test_a_text_without_a_file_is_not_saved_until_there_is_one(tmp_path: Path) -> None:
    """Also an empty one; a full disk leaves the old file, and the text unsaved."""
    session = Session(OpenedFile(tmp_path / "a.yaml", None), Folders((tmp_path,)))
    assert session.is_changed
    session.save()
    assert not session.is_changed
    assert (tmp_path / "a.yaml").read_bytes() == b""


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system's message, and no question to reload or overwrite."""
    path = tmp_path / "a.yaml"
    path.write_text("seed: 1\n")
    session = Session(read_file(path), Folders((tmp_path,)))
    session.text = "seed: 2\n"

    def fill(file: Path, data: bytes) -> int:
        with file.open("wb") as begun:
            begun.write(data[:3])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(file))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", fill)
        with pytest.raises(StorageError, match="No space left on device") as caught:
            session.save()
    assert not isinstance(caught.value, ChangedError)
    assert (path.read_text(), session.is_changed) == ("seed: 1\n", True)
    assert [file.name for file in tmp_path.iterdir()] == ["a.yaml"]
    session.save()
    assert path.read_text() == "seed: 2\n"


def test_a_file_that_another_program_changes_or_deletes_is_told(tmp_path: Path) -> None:
    """Saving asks first; written again, it has the editor's text."""
    path = tmp_path / "a.yaml"
    path.write_text("seed: 1\n")
    session = Session(read_file(path), Folders((tmp_path,)))
    assert session.find_change() == ""
    path.write_text("seed: 5\n")
    assert session.find_change() == "has changed on disk"
    with pytest.raises(ChangedError, match="has changed since it was read"):
        session.save()
    path.write_bytes(b"\xff")
    assert session.find_change() == "cannot be read any more"
    path.unlink()
    assert session.find_change() == "is gone from disk"
    with pytest.raises(ChangedError, match="is gone since it was read; overwrite it"):
        session.save()
    session.save(overwrite=True)
    assert path.read_text() == "seed: 1\n"
    assert session.find_change() == ""


def test_layers_that_no_picture_has_are_told(tmp_path: Path) -> None:
    """Of the pictures of the current text only; one that has them is enough."""
    session = make_session(tmp_path, "extends: tabletop.yaml\n")
    orders = session.orders()
    for slot, empty in enumerate(({"lanes", "text"}, {"text"})):
        session.accept(Ticket("a", slot, orders[slot]), replace(SHOWN, empty=frozenset(empty)))
    assert session.empty == ["text"]
    session.orders()
    assert session.empty == []


def test_statistics_count_boxes_per_picture() -> None:
    """By class without regard to case; medians of sizes, mean of stated occlusion."""
    assert rows(summarise([SHOWN, SHOWN]), None) == [("cup", "2", "20 x 30", "0.50")]


def test_images_of_a_data_set_are_chosen_and_sorted() -> None:
    """By class, split and number of objects."""
    cup, tall = Labelled("cup", 5, 6, 0.1), Labelled("vase", 5, 60, None)
    listed = [
        data_sets.Row(0, "color", "train", (cup,)),
        data_sets.Row(1, "color", "val", (cup, tall)),
        data_sets.Row(2, "color", "train", ()),
    ]
    indices = lambda found: [row.index for row in found]  # noqa: E731
    assert indices(data_sets.choose(listed, order="largest box")) == [1, 0, 2]
    assert indices(data_sets.choose(listed, category="cup", split="train")) == [0]
    assert indices(data_sets.choose(listed, least=2)) == [1]
    assert data_sets.count_categories(listed) == {"cup": 2, "vase": 1}


def test_our_own_scripts_stay_small() -> None:
    """Fewer than 300 lines of JavaScript: files, and texts of Python that the page runs."""
    folder = Path(server.__file__).parent
    lines = sum(len(path.read_text().splitlines()) for path in folder.glob("*.js"))
    inline = [
        node.value
        for path in folder.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and re.search(r"window\.|document\.|<script", node.value)
    ]
    assert 5 <= len(inline) < 20
    assert 100 < lines + sum(text.count("\n") + 1 for text in inline) < 300


def test_a_server_for_a_network_wants_the_token_too() -> None:
    """It does not know its own names; a page of another origin is refused as well."""
    other = {"host": "192.168.0.7:80"}
    sent, reached = ask("http", **other, hosts=frozenset())
    assert (sent[0]["status"], reached) == (403, False)
    cookie = {"cookie": f"{COOKIE}_80=secret"}
    assert ask("http", **other, **cookie, hosts=frozenset())[1]
    assert ask("websocket", **other, **cookie, origin="http://192.168.0.7:80", hosts=frozenset())[1]
    for kind in ("http", "websocket"):
        assert not ask(kind, **other, **cookie, origin="http://evil.example", hosts=frozenset())[1]
        assert not ask(kind, **other, **cookie, origin="null", hosts=frozenset())[1]


def test_the_port_of_a_file_stays_the_same_while_it_is_free(tmp_path: Path) -> None:
    """Browsers keep drafts by port; a second server of the file takes another one."""
    port = usual_port(tmp_path / "a.yaml")
    assert port == usual_port(tmp_path / "b" / ".." / "a.yaml") != usual_port(tmp_path / "b.yaml")
    assert 49152 <= port <= 65535
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        number = taken.getsockname()[1]
        assert free_port("127.0.0.1", 0, wish=number) != number
        with pytest.raises(ConfigError, match="a free port"):
            free_port("127.0.0.1", number)
    assert free_port("127.0.0.1", 0, wish=number) == number


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("mug.stl", "mug.stl"),
        ("../../mug.stl", "mug.stl"),
        ("C:\\users\\me\\mug.stl", "mug.stl"),
        ("/etc/passwd", "passwd"),
        ("..", ""),
        (".bashrc", ""),
        ("a\nb.stl", ""),
        ("", ""),
    ],
)
def test_names_of_dropped_files_have_no_folders(given: str, kept: str) -> None:
    """A name that hides the file, or could not be shown, is refused."""
    assert own_files.plain_name(given) == kept


def test_folders_follow_links(tmp_path: Path) -> None:
    """A link that leads out of the folders is outside, for reading and for saving."""
    inside = tmp_path / "in"
    inside.mkdir()
    (tmp_path / "out.yaml").write_text("seed: 1\n")
    (inside / "link.yaml").symlink_to(tmp_path / "out.yaml")
    (inside / "up").symlink_to(tmp_path)
    folders = Folders((inside.resolve(),))
    assert not folders.contains(inside / "link.yaml")
    assert not folders.contains(inside / "up/out.yaml")
    assert not folders.contains(inside / "../out.yaml")
    for named in ("link.yaml", "up/out.yaml", str(tmp_path / "out.yaml")):
        with pytest.raises(ConfigError, match="outside of the folders of this page"):
            folders.refuse_outside(f"extends: {named}\n", str(inside / "a.yaml"))
    folders.refuse_outside("extends: tabletop.yaml\n", str(inside / "a.yaml"))
    session = Session(OpenedFile(inside / "a.yaml", None), folders, "seed: 2\n")
    with pytest.raises(StorageError, match="outside"):
        session.save_as(inside / "link.yaml", overwrite=True)
    assert (tmp_path / "out.yaml").read_text() == "seed: 1\n"
    with pytest.raises(StorageError, match=r"sub does not exist; expected a folder that is there"):
        session.save_as(inside / "sub/b.yaml")
    session.save_as(inside / "second")
    assert session.file.path == inside / "second.yaml"
    assert session.file.path.read_text() == "seed: 2\n"
