"""Data sets at URLs: a real S3 server in a separate process, and storage in memory."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import fsspec
import pytest

from gen_data.api.generate import generate
from gen_data.cli.main import cli
from gen_data.core.errors import ConfigError, DeterminismError, StorageError, VerificationError
from gen_data.runner import object_store
from gen_data.runner.object_store import ObjectFolder, copy_outline, open_store
from gen_data.runner.progress import RunProgress
from gen_data.runner.run import Settings, Summary, run
from gen_data.runner.stored import StoredSamples
from gen_data.runner.stored_objects import open_stored
from gen_data.runner.verify import find_deviations
from tests.runner.doubles import FakeFactory, fake_plan, make, tree_digest, write_raw_images
from tests.runner.fake_run import SHARD_SIZE, N
from tests.runner.test_processes import ROOT, wait_for


@pytest.fixture(autouse=True)
def staging(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def make_at(
    url: str, n: int = 10, progress: Callable[[RunProgress], None] | None = None, **changes: object
) -> Summary:
    return run(
        replace(fake_plan(n), **changes),
        FakeFactory(n),
        url,
        Settings(resume_command="again", progress=progress, write_media=write_raw_images),
        licences=lambda assets: f"# Assets\n\n{', '.join(assets)}\n",
    )


def download(url: str, folder: Path) -> Path:
    objects = ObjectFolder(url)
    objects.download({name: folder / name for name in objects.tree()})
    return folder


def test_a_url_holds_the_bytes_of_a_folder_and_is_extended(
    tmp_path: Path, memory: str, reference_digest: str
) -> None:
    summary = make_at(memory)
    assert tree_digest(download(memory, tmp_path / "copy")) == reference_digest
    assert summary.made == 10
    again = make_at(memory)
    assert again.already_complete and again.dataset_id == summary.dataset_id
    # Nothing stays in the staging folder.
    assert not list((tmp_path / "cache").rglob("*.png"))
    make(tmp_path / "more", 22)
    assert make_at(memory, 22).made == 14  # The last shard of the first run was shorter.
    assert tree_digest(download(memory, tmp_path / "new")) == tree_digest(tmp_path / "more")


def test_a_failure_of_any_put_is_repaired_by_resumption(
    tmp_path: Path, memory: str, monkeypatch: pytest.MonkeyPatch, reference_digest: str
) -> None:
    system = fsspec.filesystem("memory")
    calls = []

    def failing(name: str, fails_at: int) -> Any:
        operation = getattr(type(system), name)

        def operate(self: Any, *arguments: Any, **options: Any) -> Any:
            calls.append(name)
            if len(calls) == fails_at:
                raise ConnectionResetError("reset by peer")
            return operation(self, *arguments, **options)

        return operate

    def make_with_failure(fails_at: int) -> int:
        """Number of PUTs of a run whose k-th one fails."""
        calls.clear()
        system.store.clear()
        system.pseudo_dirs[:] = [""]
        with monkeypatch.context() as patched:
            for name in ("pipe_file", "put_file", "cp_file"):
                patched.setattr(type(system), name, failing(name, fails_at))
            if fails_at == 0:
                make_at(memory)
                return len(calls)
            with pytest.raises(StorageError, match="reset by peer"):
                make_at(memory)
        return len(calls)

    puts = make_with_failure(0)
    assert puts > 20
    for fails_at in range(1, puts + 1):
        assert make_with_failure(fails_at) == fails_at
        assert not system.exists(f"{memory}/manifest.json")
        make_at(memory)
        assert tree_digest(download(memory, tmp_path / f"{fails_at}")) == reference_digest


def test_other_bytes_of_a_shard_are_refused(memory: str) -> None:
    make_at(memory)
    plan, system = fake_plan(), fsspec.filesystem("memory")
    store = open_store(memory)
    store.prepare(plan)
    store.scan(plan)
    record = store.record(1)
    assert record is not None
    other = replace(record, rejections=record.rejections + 1)
    system.pipe_file(f"{memory}/shards/000001.json", other.to_bytes())
    with pytest.raises(DeterminismError, match="shard 1 came out differently"):
        store.commit(store.scratch_dir(), record)


def test_damage_at_a_url_is_found_and_made_again(
    tmp_path: Path, memory: str, reference_digest: str
) -> None:
    make_at(memory)
    system = fsspec.filesystem("memory")
    system.pipe_file(f"{memory}/shards/000001/color/rgb/000000005.png", b"short")
    copy_outline(ObjectFolder(memory), tmp_path / "outline")
    [finding] = find_deviations(tmp_path / "outline")
    assert (finding.path, finding.samples) == ("shards/000001/color/rgb/000000005.png", "sample 5")
    assert not make_at(memory).already_complete
    assert tree_digest(download(memory, tmp_path / "copy")) == reference_digest


def test_foreign_places_and_unknown_schemes_are_refused(memory: str) -> None:
    fsspec.filesystem("memory").pipe_file(f"{memory}/notes.txt", b"mine")
    with pytest.raises(StorageError, match="not empty and not a gen-data data set"):
        make_at(memory)
    with pytest.raises(ConfigError, match=r"pip install .*\[cloud\]'"):
        make_at("nosuch://bucket/set")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of the server
def test_a_killed_run_on_s3_is_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from moto.server import ThreadedMotoServer

    make(tmp_path / "here", N, SHARD_SIZE)
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_DEFAULT_REGION"):
        monkeypatch.setenv(name, "us-east-1")
    try:
        fsspec.filesystem("s3").mkdir("bucket")
        url = "s3://bucket/set"
        objects = ObjectFolder(url)
        command = [sys.executable, "-m", "tests.runner.fake_run", url, "2", "0.04"]
        killed = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
        wait_for(lambda: sum(n.endswith(".json") for n in objects.names("shards")) >= 3)
        os.killpg(killed.pid, signal.SIGKILL)
        killed.wait()
        assert "manifest.json" not in objects.names()
        subprocess.run(command, cwd=ROOT, check=True, timeout=120)
        assert tree_digest(download(url, tmp_path / "copy")) == tree_digest(tmp_path / "here")
        objects.create("run/once", b"first")
        objects.create("run/once", b"second")
        assert objects.read(["run/once"]) == {"run/once": b"first"}
    finally:
        server.stop()


def test_samples_are_read_from_a_url(finished: Path, memory: str, staging: Path) -> None:
    make_at(memory)
    here, there = StoredSamples(finished), open_stored(memory)
    assert there.dataset_id == here.dataset_id and there.n == 10
    assert there.kept_scene(5) == here.kept_scene(5)
    # The shard of sample 5 alone was copied.
    copied = (staging / "gen-data" / "data-sets" / here.dataset_id / "shards").iterdir()
    assert [path.name for path in copied] == ["000001"]
    with pytest.raises(StorageError, match="expected a folder: copy the data set first"):
        StoredSamples(memory)
    with pytest.raises(StorageError, match="no finished data set"):
        open_stored("memory://bucket/other")


def test_the_command_line_verifies_urls_and_names_them(
    memory: str, capsys: pytest.CaptureFixture[str]
) -> None:
    make_at(memory)
    cli.main(["verify", memory, "--full"], standalone_mode=False)
    assert f"{memory}: 10 samples" in capsys.readouterr().out
    fsspec.filesystem("memory").rm_file(f"{memory}/shards/000001/labels.jsonl")
    with pytest.raises(VerificationError, match=f"{memory}: 1 deviation") as caught:
        cli.main(["verify", memory], standalone_mode=False)
    assert "labels.jsonl (samples 4 to 7): is missing" in str(caught.value)
    with pytest.raises(ConfigError, match="expected a folder: copy the data set first"):
        cli.main(["report", memory], standalone_mode=False)
    with pytest.raises(ConfigError, match="cannot be repaired in place"):
        generate("tabletop.yaml", 10, out=memory, repair=True)


def exchange(path: str) -> None:
    """Change the first byte of an object in memory: its size stays."""
    system = fsspec.filesystem("memory")
    data = system.cat_file(path)
    system.pipe_file(path, bytes([data[0] ^ 1]) + data[1:])


@pytest.mark.parametrize(
    ("changed", "lost"),
    [*((name, "") for name in (
        "shards/000001/color/rgb/000000005.png", "shards/000001/labels.jsonl", "shards/000002.json",
        "lines/all.jsonl", "README.md", "SHA256SUMS", "manifest.json", "plan.json")),
     *(("shards/000001/color/rgb/000000005.png", name) for name in (
         "shards/000000/labels.jsonl", "manifest.json", "plan.json"))],
)  # fmt: skip
def test_the_command_that_made_a_data_set_repairs_changed_and_missing_objects(
    changed: str, lost: str, tmp_path: Path, memory: str, reference_digest: str
) -> None:
    """Changed objects keep their size."""
    made = make_at(memory)
    exchange(f"{memory}/{changed}")
    if lost:
        fsspec.filesystem("memory").rm_file(f"{memory}/{lost}")
    repaired = make_at(memory)
    assert not repaired.already_complete and repaired.dataset_id == made.dataset_id
    copy = download(memory, tmp_path / "copy")
    assert tree_digest(copy) == reference_digest
    assert find_deviations(copy, full=True) == []


def test_objects_are_hashed_in_batches_of_few_bytes_with_progress(
    tmp_path: Path, memory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_at(memory)
    monkeypatch.setattr(object_store, "BATCH_BYTES", 1000)
    objects, shown = ObjectFolder(memory), []
    sizes = objects.tree()
    batches: list[int] = []

    def get(self: Any, paths: list[str], files: list[str]) -> None:
        batches.append(sum(sizes[path.removeprefix(objects.path(""))] for path in paths))
        for path, file in zip(paths, files, strict=True):
            Path(file).write_bytes(self.cat_file(path))

    monkeypatch.setattr(type(fsspec.filesystem("memory")), "get", get)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    found = objects.digests(sizes, scratch, shown.append)

    assert found == {n: sha256(data).hexdigest() for n, data in objects.read(sizes).items()}
    assert len(batches) > 1 and sum(batches) == sum(sizes.values())
    assert all(size <= 1000 or size in sizes.values() for size in batches)
    assert shown == sorted(shown) and shown[-1] == 1.0
    assert not list(scratch.iterdir())


def test_checking_a_finished_data_set_at_a_url_is_shown(memory: str) -> None:
    make_at(memory)
    shown: list[RunProgress] = []
    make_at(memory, progress=shown.append)
    assert {one.phase for one in shown} == {"checking"}
    assert shown[-1].done == shown[-1].total == 10


def test_a_staging_folder_that_cannot_be_made_is_an_error_with_the_remedy(
    tmp_path: Path, memory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_at(memory)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    for use in (make_at, open_stored):
        with pytest.raises(StorageError, match=r"(?s)/file.*oint XDG_CACHE_HOME to a folder"):
            use(memory)
