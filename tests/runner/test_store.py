"""LocalStore: commits, resumption, foreign folders, locks, and a disk that fails anywhere."""

import errno
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

import gen_data
from gen_data.core.capture import Capture
from gen_data.core.errors import ConfigError, DeterminismError, SampleError, StorageError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import Sample
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.runner import durable_files
from gen_data.runner.plan import load_plan
from gen_data.runner.provenance import parse_scene, scene_line
from gen_data.runner.run import Settings, run
from gen_data.runner.shard import Job, make_shard
from gen_data.runner.store import FolderState, LocalStore
from gen_data.runner.verify import verify
from tests.runner import doubles
from tests.runner.fragile_disk import ERRNOS, FragileDisk, Killed


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_finished_folder_holds_what_the_layout_says_with_sums_and_id(finished: Path) -> None:
    """Plan, shards with records, exporter's folder, licences, sums, manifest, run.

    The tool sha256sum accepts the data set and covers every file of it; the documented shell line
    computes dataset_id.
    """
    assert names_in(finished) == {
        "plan.json",
        "shards",
        "lines",
        "LICENSES-ASSETS.md",
        "README.md",
        "croissant.json",
        "SHA256SUMS",
        "manifest.json",
        "run",
    }
    shards = {f"00000{k}{end}" for k in range(3) for end in ("", ".json")}
    assert names_in(finished / "shards") == shards
    assert not (finished / "run" / "tmp").exists()
    check = "sha256sum --check --strict --quiet SHA256SUMS"
    assert subprocess.run(check, shell=True, cwd=finished, check=False).returncode == 0
    listed = {line[66:] for line in (finished / "SHA256SUMS").read_text().splitlines()}
    files = (path.relative_to(finished) for path in finished.rglob("*") if path.is_file())
    there = {path.as_posix() for path in files if path.parts[0] != "run"}
    assert listed == there - {"SHA256SUMS"}
    line = "grep -v '  manifest.json$' SHA256SUMS | sha256sum"
    printed = subprocess.check_output(line, shell=True, cwd=finished, text=True).split()[0]
    assert json.loads((finished / "manifest.json").read_text())["dataset_id"] == printed


def test_manifest_and_provenance_count_and_list_the_samples(finished: Path) -> None:
    """Ten samples of five scenes, two views each; scene 3 is validation, one object per image.

    scenes.jsonl: index, scene, view, split, attempts and the scene itself.
    """
    manifest = json.loads((finished / "manifest.json").read_text())
    assert manifest["splits"] == [
        {"split": "train", "samples": 8, "objects": {"bowl": 4, "mug": 4}},
        {"split": "val", "samples": 2, "objects": {"bowl": 1, "mug": 1}},
    ]
    assert (manifest["scenes"], manifest["rejections"]) == (5, 0 + 1 + 2 + 0 + 1)
    lines = (finished / "shards" / "000001" / "scenes.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    keys = ("index", "scene_index", "view_index", "split", "base")
    assert [tuple(row[key] for key in keys) for row in rows] == [
        (4, 2, 0, "train", None),
        (5, 2, 1, "train", 4),
        (6, 3, 0, "val", None),
        (7, 3, 1, "val", 6),
    ]
    assert rows[0]["scene"]["instances"][0]["name"] == "thing-4"


def test_views_keep_what_differs_and_read_back_complete() -> None:
    """The second line of a scene repeats no field of the first line."""
    one = Scene("test", bodies=(Body("a", "mug"),))
    other = replace(one, cameras=(Camera("c", SE3(), Intrinsics.from_hfov(64, 48, 1.0)),))
    first, second = (
        Sample(4 + view, 2, view, "train", scene, Capture({}), {})
        for view, scene in enumerate((one, other))
    )
    lines = {4: scene_line(first, None).encode(), 5: scene_line(second, first).encode()}
    assert set(json.loads(lines[5])["scene"]) == {"cameras"}
    whole = parse_scene(lines[4], {}.__getitem__)
    kept = [whole, parse_scene(lines[5], {4: whole.scene}.__getitem__)]
    assert [one.scene for one in kept] == [first.scene, second.scene]
    assert [(one.index, one.view_index) for one in kept] == [(4, 0), (5, 1)]


def test_exporters_see_no_pixels(tmp_path: Path) -> None:
    """A shard's images are not held in memory: readings arrive with cameras only."""
    seen = []

    class Watching:
        needs: frozenset[str] = frozenset()

        def write_shard(self, info: object, samples: object, shard_dir: Path) -> None:
            del info, shard_dir
            seen.extend(samples)  # type: ignore[call-overload]

        def finalize(self, *arguments: object) -> None:
            """Nothing to merge."""

    store = LocalStore(tmp_path / "out")
    plan = doubles.fake_plan()
    job = Job(plan, store, doubles.FakeFactory(10), doubles.write_raw_images)
    with store.locked():
        store.prepare(plan)
        pipeline = doubles.FakePipeline(10, doubles.Trouble(), {"watching": Watching()})
        make_shard(job, pipeline, 0, lambda _: None)

    assert [sample.index for sample in seen] == [0, 1, 2, 3]
    assert all(s.capture.readings["color"].channels == {} for s in seen)
    assert all(s.capture.readings["color"].camera.name == "color" for s in seen)


def test_a_finished_data_set_is_left_alone(tmp_path: Path) -> None:
    """The same command again makes nothing, changes nothing, and reports it."""
    doubles.make(tmp_path / "out")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*") if "run" not in str(p)}
    summary = doubles.make(tmp_path / "out")
    manifest = json.loads((tmp_path / "out/manifest.json").read_text())
    assert summary.already_complete
    assert (summary.made, summary.dataset_id) == (0, manifest["dataset_id"])
    assert "nothing to do" in dict(summary.rows())["samples"]
    after = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*") if "run" not in str(p)}
    assert after == before


@pytest.mark.parametrize(
    ("n", "changes", "message"),
    [(10, {"camera": {"fov_deg": 60}}, r"camera\.fov_deg: was 50, now 60"),
     (9, {}, r"holds 10 samples; nothing was changed\. Expected --n 10")],
    ids=["another plan", "a smaller n"],
)  # fmt: skip
def test_another_plan_is_refused_naming_the_field(
    tmp_path: Path, n: int, changes: dict[str, object], message: str
) -> None:
    """Nothing is written; the message has the dotted field and both values."""
    out = tmp_path / "out"
    doubles.make(out)
    before = doubles.tree_digest(out)
    plan, factory = doubles.fake_plan(n, **changes), doubles.FakeFactory(n)
    with pytest.raises(StorageError, match=message):
        run(plan, factory, out, Settings())
    assert doubles.tree_digest(out) == before


@pytest.mark.parametrize(("first", "more"), [(10, 11), (8, 17), (10, 30)])
def test_a_larger_n_extends_a_finished_data_set(tmp_path: Path, first: int, more: int) -> None:
    """It equals a new data set of that size; whole shards of the old one are kept."""
    doubles.make(tmp_path / "out", first)
    whole = [f"shards/{k:06d}" for k in range(first // 4)]
    before = {p: p.stat().st_mtime_ns for k in whole for p in (tmp_path / "out" / k).rglob("*")}
    summary = doubles.make(tmp_path / "out", more)
    doubles.make(tmp_path / "new", more)
    assert doubles.tree_digest(tmp_path / "out") == doubles.tree_digest(tmp_path / "new")
    assert summary.made == more - 4 * (first // 4)
    assert before == {path: path.stat().st_mtime_ns for path in before}
    verify(tmp_path / "out", full=True)


def test_an_extension_can_be_interrupted(tmp_path: Path) -> None:
    """The plan is renewed first: the same command goes on."""
    doubles.make(tmp_path / "out", 10)
    with pytest.raises(SampleError):
        doubles.make(tmp_path / "out", 20, trouble=doubles.Trouble(wrong_at=14))
    doubles.make(tmp_path / "out", 20)
    doubles.make(tmp_path / "new", 20)
    assert doubles.tree_digest(tmp_path / "out") == doubles.tree_digest(tmp_path / "new")


@pytest.mark.parametrize("name", ["holiday.jpg", "run/holiday.jpg", "manifest.json", "shards/x"])
def test_a_foreign_folder_is_refused_and_not_touched(tmp_path: Path, name: str) -> None:
    """Whatever lies there without a plan.json is somebody else's."""
    foreign = tmp_path / "out" / name
    foreign.parent.mkdir(parents=True)
    foreign.write_text("mine")
    with pytest.raises(StorageError, match="not empty and not a gen-data data set"):
        doubles.make(tmp_path / "out")
    assert [p for p in (tmp_path / "out").rglob("*") if p.is_file()] == [foreign]


def test_empty_folders_and_killed_starts_are_new_and_plans_take_no_memory(tmp_path: Path) -> None:
    """The lock may be there before the plan is."""
    (tmp_path / "out" / "run").mkdir(parents=True)
    (tmp_path / "out" / "run" / "lock").write_text("")
    store = LocalStore(tmp_path / "out")
    assert store.state(doubles.fake_plan()) is FolderState.NEW
    assert LocalStore(tmp_path / "absent").state(doubles.fake_plan()) is FolderState.NEW
    # Shards of a new data set are a range, not a list.
    plan = doubles.fake_plan(n=1_000_000_000, shard_size=64)
    with store.locked():
        store.prepare(plan)
        assert store.scan(plan).missing == range(15_625_000)


def test_a_second_run_is_refused_before_its_configuration_is_read(tmp_path: Path) -> None:
    """A fault of usage that names host and process: repeating the command does not help."""
    store = LocalStore(tmp_path / "out")
    with (
        store.locked(),
        pytest.raises(ConfigError, match=rf"another run.*process {os.getpid()} on host") as caught,
    ):
        doubles.make(tmp_path / "out")
    assert caught.value.exit_code == 2
    assert doubles.make(tmp_path / "out").made == 10
    # Within a second, although the configuration of this one does not even exist.
    with LocalStore(tmp_path).locked(), pytest.raises(ConfigError, match=r"another run .* on host"):
        gen_data.generate("no-such-file.yaml", 1, out=tmp_path)
    with pytest.raises(ConfigError, match="no-such-file"):
        gen_data.generate("no-such-file.yaml", 1, out=tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"occlusion": 1.5}, r"sample 5: truth\.color\.objects\[0\].*occlusion: 1\.5 is not in"),
     ({"extra": {"mine": {"x": [float("nan")]}}}, r"sample 5: .*extra\.mine\.x\[0\]: is NaN")],
)  # fmt: skip
def test_no_invalid_sample_is_left(tmp_path: Path, change: dict[str, object], message: str) -> None:
    """The run stops with exit code 6, sample and field; the shards before it stay."""

    class Invalid(doubles.FakePipeline):
        def sample(self, index: int) -> Sample:
            sample = super().sample(index)
            if index != 5:
                return sample
            image = sample.truth["color"]
            objects = (replace(image.objects[0], **change),)  # type: ignore[arg-type]
            return replace(sample, truth={"color": replace(image, objects=objects)})

    make = partial(Invalid, 10, doubles.Trouble())
    with pytest.raises(SampleError, match=message) as caught:
        run(doubles.fake_plan(), make, tmp_path / "out", Settings())

    assert caught.value.exit_code == 6
    assert names_in(tmp_path / "out/shards") == {"000000", "000000.json"}


def test_publishing_a_shard_again_changes_nothing_and_other_bytes_are_wrong(tmp_path: Path) -> None:
    """A worker that died after its commit is repeated harmlessly.

    The error names the file, and both versions are kept: the second one lies in quarantine.
    """
    store, plan = LocalStore(tmp_path / "out"), doubles.fake_plan()

    def write_other_images(info: object, sample: object, shard_dir: Path) -> None:
        doubles.write_raw_images(info, sample, shard_dir)  # type: ignore[arg-type]
        path = shard_dir / "color/rgb/000000005.png"
        if path.exists():
            path.write_bytes(b"other")

    job = Job(plan, store, doubles.FakeFactory(10), doubles.write_raw_images)
    with store.locked():
        store.prepare(plan)
        first = make_shard(job, job.make_pipeline(), 1, lambda _: None).record
        before = doubles.tree_digest(tmp_path / "out")
        assert make_shard(job, job.make_pipeline(), 1, lambda _: None).record == first
        assert doubles.tree_digest(tmp_path / "out") == before
        other = replace(job, write_media=write_other_images)
        with pytest.raises(DeterminismError, match=r"shard 1.*color/rgb/000000005\.png"):
            make_shard(other, job.make_pipeline(), 1, lambda _: None)
    kept = list((tmp_path / "out/run/quarantine").rglob("000000005.png"))
    assert [path.read_bytes() for path in kept] == [b"other"]
    assert (tmp_path / "out/shards/000001/color/rgb/000000005.png").read_bytes() != b"other"


def count_operations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    disk = FragileDisk(tmp_path / "count", tmp_path / "attic")
    with monkeypatch.context() as patch:
        disk.install(patch)
        doubles.make(tmp_path / "count")
    return disk.count


def test_a_kill_at_every_operation_is_resumed_to_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference_digest: str
) -> None:
    """Each fsync, rename, mkdir and unlink of a three-shard run, one after the other.

    A killed process leaves the folder as it was: copies of one run, one per operation, are resumed.
    """
    running, killed = tmp_path / "running", tmp_path / "killed"

    def copy_folder(number: int) -> None:
        if running.exists():
            shutil.copytree(running, killed / str(number))
        else:
            (killed / str(number)).mkdir(parents=True)

    disk = FragileDisk(running, tmp_path / "attic", before=copy_folder)
    with monkeypatch.context() as patch:
        disk.install(patch)
        doubles.make(running)
    assert disk.count > 80

    for k in range(1, disk.count + 1):
        out = killed / str(k)
        if not (out / "manifest.json").exists():
            doubles.make(out)
        assert doubles.tree_digest(out) == reference_digest, f"killed at operation {k}"


@pytest.mark.parametrize("step", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_every_errno_at_every_operation_is_one_message_and_resumable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference_digest: str, step: int
) -> None:
    """Path, errno and the resume command; then the same bytes once it is gone.

    At every seventh operation, and, slowly, at all of them.
    Where the fault only hits the tidying up after the manifest, the run succeeds.
    """
    for k in range(1, count_operations(tmp_path, monkeypatch) + 1, step):
        out = tmp_path / f"out{k}"
        number = ERRNOS[k % len(ERRNOS)]
        message = ""
        with monkeypatch.context() as patch:
            FragileDisk(out, tmp_path / f"attic{k}", fail_at=k, errno=number).install(patch)
            try:
                doubles.make(out)
            except StorageError as error:
                message = str(error)
        facts = (f"({errno.errorcode[number]})", str(out), doubles.RESUME)
        assert all(fact in message for fact in facts) or (out / "manifest.json").exists()
        doubles.make(out)
        assert doubles.tree_digest(out) == reference_digest, (
            f"{errno.errorcode[number]} at operation {k}"
        )
        shutil.rmtree(out)


def survives_power_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, digest: str, fail_at: int, seed: int
) -> bool:
    """Whether a folder comes back to ``digest`` after a power cut at an operation, 0 = the end.

    A folder that has a manifest must be right as it is.
    """
    out, attic = tmp_path / f"out{fail_at}-{seed}", tmp_path / f"attic{fail_at}-{seed}"
    disk = FragileDisk(out, attic, fail_at=fail_at)
    with monkeypatch.context() as patch:
        disk.install(patch)
        with suppress(Killed):
            doubles.make(out)
        disk.cut_power(seed)
    try:
        if not (out / "manifest.json").exists():
            assert fail_at, "the data set was finished before the cut"
            doubles.make(out)
        return doubles.tree_digest(out) == digest
    except (AssertionError, StorageError):
        return False
    finally:
        shutil.rmtree(out, ignore_errors=True)
        shutil.rmtree(attic)


@pytest.mark.slow
def test_a_power_cut_at_every_operation_is_resumed_to_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference_digest: str
) -> None:
    """Unsynced bytes and names are lost at random; no committed shard is."""
    for k in range(count_operations(tmp_path, monkeypatch) + 1):
        assert survives_power_cut(tmp_path, monkeypatch, reference_digest, k, seed=k), (
            f"power cut at operation {k}"
        )


def plain_write(path: Path, data: bytes, scratch: Path) -> None:
    del scratch
    path.write_bytes(data)


def plain_replace(store: LocalStore, name: str, data: bytes, scratch: Path) -> None:
    plain_write(store.root / name, data, scratch)


@pytest.mark.parametrize(
    ("place", "mutant"),
    [("store.sync_tree", lambda folder, synced: None),
     ("durable_files.sync_tree", lambda folder, synced: None), ("store.write_durably", plain_write),
     ("store.LocalStore.replace_file", plain_replace),
     ("durable_files.sync_path", lambda path: None)],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_the_power_cut_harness_catches_a_missing_fsync(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    reference_digest: str,
    place: str,
    mutant: object,
) -> None:
    """With one kind of fsync planted out, a cut after the end damages a finished data set."""
    monkeypatch.setattr(f"gen_data.runner.{place}", mutant)
    survived = [
        survives_power_cut(tmp_path, monkeypatch, reference_digest, 0, seed) for seed in range(12)
    ]
    assert not all(survived)


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "tiny"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("mounting a small file system needs root")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_full_disk_is_one_message_and_resumable_after_making_room(
    tiny_disk: Path, reference_digest: str
) -> None:
    """A real file system without space: exit by StorageError, then the same bytes."""
    out, ballast = tiny_disk / "out", tiny_disk / "ballast"
    ballast.write_bytes(b"\0" * (990 << 10))
    with pytest.raises(StorageError, match=r"ENOSPC|stopped before the disk is full") as caught:
        doubles.make(out)
    assert doubles.RESUME in str(caught.value)
    ballast.unlink()
    doubles.make(out)
    assert doubles.tree_digest(out) == reference_digest


def test_a_run_that_will_not_fit_stops_after_its_first_shard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """6 of 10 samples to go at about 1.2 kB each: 2 kB free are not enough, the shard stays."""
    monkeypatch.setattr("gen_data.runner.store.free_bytes", lambda path: 2_000)
    with pytest.raises(StorageError, match="other 6 samples need about") as caught:
        doubles.make(tmp_path / "out")
    assert doubles.RESUME in str(caught.value)
    assert names_in(tmp_path / "out" / "shards") == {"000000", "000000.json"}


def test_a_plan_is_the_first_file_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever a run stops, a folder with shards has a plan."""
    monkeypatch.setattr(LocalStore, "scan", lambda *_, **__: (_ for _ in ()).throw(Killed()))
    with pytest.raises(Killed):
        doubles.make(tmp_path / "out")
    assert load_plan(tmp_path / "out") == doubles.fake_plan()


def test_tree_sizes_reports_links_as_irregular(tmp_path: Path) -> None:
    """A symbolic link, to a file or to a folder, does not count as content."""
    (tmp_path / "a").write_text("abc")
    (tmp_path / "b").symlink_to("a")
    (tmp_path / "c").symlink_to(tmp_path, target_is_directory=True)
    assert durable_files.tree_sizes(tmp_path) == {
        "a": 3,
        "b": durable_files.IRREGULAR,
        "c": durable_files.IRREGULAR,
    }


@pytest.mark.parametrize(
    ("place", "fact"),
    [("file/below", r"/file: is not a folder"), ("file", r"/file: is not a folder"),
     ("link", r"/link: links to nowhere, which does not exist"),
     ("link/below", r"/link: links to nowhere, which does not exist"),
     ("n" * 300, r"File name too long")],
)  # fmt: skip
def test_a_place_where_no_folder_can_be_is_named(tmp_path: Path, place: str, fact: str) -> None:
    """With the remedy that helps: repeating the command does not, and nothing is finished."""
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(StorageError, match=fact) as caught:
        doubles.make(tmp_path / place)
    assert "choose another folder with --out" in str(caught.value).lower()
    assert "finished" not in str(caught.value)
