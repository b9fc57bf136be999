"""Only wanted plain files inside the folder come out of an archive, and never too many bytes."""

import io
import tarfile
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from gen_data.core.errors import AssetError
from gen_data.packs.archives import Limits, extract

Members = Iterable[tuple[str, bytes]]
Maker = Callable[[Path, Members], Path]
CONTENT = {"data/a.txt": b"alpha", "data/sub/b.txt": b"beta", "code/evil.py": b"print()"}


def zipped(folder: Path, members: Members) -> Path:
    path = folder / "archive.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return path


def tarred(folder: Path, members: Members, mode: str = "w:xz") -> Path:
    path = folder / "archive.tar"
    with tarfile.open(path, mode) as archive:  # type: ignore[call-overload]
        for name, data in members:
            info = tarfile.TarInfo(f"./{name}")
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


def debian(folder: Path, members: Members) -> Path:
    """A Debian package: an ar archive of three members, each at an even offset."""
    data = tarred(folder, members).read_bytes()
    path = folder / "archive.deb"
    with path.open("wb") as file:
        file.write(b"!<arch>\n")
        for name, content in (
            ("debian-binary", b"2.0\n"),
            ("control.tar.xz", b"odd"),
            ("data.tar.xz", data),
        ):
            file.write(f"{name:<16}{0:<12}{0:<6}{0:<6}{100644:<8}{len(content):<10}`\n".encode())
            file.write(content + b"\n" * (len(content) % 2))
    return path


def files_in(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("make", [zipped, tarred, debian])
def test_exactly_the_wanted_members_come_out(make: Maker, tmp_path: Path) -> None:
    target = tmp_path / "out"
    names = extract(make(tmp_path, CONTENT.items()), ("data/*",), target)
    assert set(names) == {"data/a.txt", "data/sub/b.txt"}
    assert files_in(target) == {"data/a.txt": b"alpha", "data/sub/b.txt": b"beta"}


def test_members_of_an_archive_inside_an_archive_follow_its_path(tmp_path: Path) -> None:
    """As in the furniture package: zips in the tar of a Debian package."""
    cars = {"car/car.obj": b"v 0 0 0", "car/readme.html": b"no"}
    inner = zipped(tmp_path, cars.items()).read_bytes()
    package = debian(tmp_path, [("usr/share/cars.sh3f", inner), ("usr/share/doc", b"text")])
    extract(package, ("usr/share/*.sh3f/*.obj",), tmp_path / "out")
    assert files_in(tmp_path / "out") == {"usr/share/cars.sh3f/car/car.obj": b"v 0 0 0"}


@pytest.mark.hostile
@pytest.mark.parametrize("make", [zipped, tarred])
@pytest.mark.parametrize("name", ["../evil.txt", "data/../../evil.txt", "/evil.txt", "a\\evil.txt"])
def test_a_member_outside_its_folder_is_refused(make: Maker, name: str, tmp_path: Path) -> None:
    """Nothing is written next to the folder."""
    inside = tmp_path / "inside"
    inside.mkdir()
    archive = make(inside, [(name, b"x")])
    with pytest.raises(AssetError, match="outside its folder"):
        extract(archive, ("*",), inside / "out")
    assert not (tmp_path / "evil.txt").exists()
    assert not (inside / "evil.txt").exists()


@pytest.mark.hostile
@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE])
def test_links_and_devices_are_refused(kind: bytes, tmp_path: Path) -> None:
    """A wanted name must be a plain file."""
    path = tmp_path / "archive.tar"
    with tarfile.open(path, "w") as archive:
        info = tarfile.TarInfo("data/link")
        info.type, info.linkname = kind, "/etc/passwd"
        archive.addfile(info)
    with pytest.raises(AssetError, match="a link or a device"):
        extract(path, ("data/*",), tmp_path / "out")


def test_a_symbolic_link_in_a_zip_is_refused(tmp_path: Path) -> None:
    """Zips keep the Unix mode in the upper half of the external attributes."""
    path = tmp_path / "archive.zip"
    with zipfile.ZipFile(path, "w") as archive:
        info = zipfile.ZipInfo("data/link")
        info.external_attr = 0o120777 << 16
        archive.writestr(info, "/etc/passwd")
    with pytest.raises(AssetError, match="a link or a device"):
        extract(path, ("data/*",), tmp_path / "out")


@pytest.mark.hostile
@pytest.mark.parametrize("make", [zipped, tarred])
@pytest.mark.parametrize("wanted", ["data/*", "other/*"])
def test_a_bomb_is_refused_before_the_disk_is_full(
    make: Maker, wanted: str, tmp_path: Path
) -> None:
    """Forty megabytes of zeros compress a thousandfold; unwanted members cost time, too."""
    archive = make(tmp_path, [("data/zeros", bytes(40_000_000))])
    with pytest.raises(AssetError, match="times its size"):
        extract(archive, (wanted,), tmp_path / "out")
    assert files_in(tmp_path / "out") == {}


@pytest.mark.parametrize(("wanted", "limits", "message"), [
    ("data/*", Limits(members=1), "more than 1 members"),
    ("data/*", Limits(file_bytes=4), "more than 4"),
    ("data/*", Limits(total_bytes=6), "exceed 6 bytes"),
    ("models/*", Limits(), "none of the wanted members"),
])  # fmt: skip
def test_limits_are_kept_and_some_member_is_wanted(
    wanted: str, limits: Limits, message: str, tmp_path: Path
) -> None:
    """Number of members, size of one, size of all."""
    with pytest.raises(AssetError, match=message):
        extract(zipped(tmp_path, CONTENT.items()), (wanted,), tmp_path / "out", limits)


def test_a_name_that_occurs_twice_is_refused(tmp_path: Path) -> None:
    path = tarred(tmp_path, [("data/a", b"one"), ("data/a", b"two")])
    with pytest.raises(AssetError, match="twice"):
        extract(path, ("data/*",), tmp_path / "out")


@pytest.mark.hostile
@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 no zip at all", b"!<arch>\nno", b"\x00" * 600])
def test_other_files_than_archives_are_an_error_in_words(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "archive"
    path.write_bytes(data)
    with pytest.raises(AssetError, match="nothing was installed"):
        extract(path, ("*",), tmp_path / "out")
