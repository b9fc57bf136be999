"""``gen-data cache``: what is kept between runs, and its removal."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from gen_data.assets.library import open_library
from gen_data.cli import cache_commands
from gen_data.cli.cache_commands import Cache, cache


@pytest.fixture
def caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's cache folder with a mug, a staged shard, and one megabyte of kernels."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    open_library().mesh("mug?seed=1")
    staged = tmp_path / "gen-data" / "staging" / "s3" / "shard"
    staged.mkdir(parents=True)
    (staged / "image.png").write_bytes(b"x" * 1000)
    kernels = tmp_path / "warp"
    kernels.mkdir()
    (kernels / "module.o").write_bytes(b"x" * 1_000_000)
    *others, old = cache_commands.CACHES
    known = (*others, Cache("kernels", old.content, lambda: [kernels]))
    monkeypatch.setattr(cache_commands, "CACHES", known)
    return tmp_path


def test_info_tells_places_sizes_and_numbers_of_files(caches: Path) -> None:
    """An absent cache has no files."""
    printed = CliRunner().invoke(cache, ["info"]).output.splitlines()
    lines = {
        line.split()[0]: line + place
        for line, place in zip(printed[::2], printed[1::2], strict=True)
    }

    assert "1.0 MB" in lines["kernels"]
    assert " 1 files" in lines["kernels"]
    assert str(caches / "warp") in lines["kernels"]
    assert " 0 files" in lines["urls"]
    assert str(caches / "gen-data") in lines["assets"]


def test_clear_removes_the_named_cache_only(caches: Path) -> None:
    done = CliRunner().invoke(cache, ["clear", "kernels"])

    assert done.output == "kernels: 1.0 MB removed\n"
    assert not (caches / "warp").exists()
    assert list((caches / "gen-data").glob("format-*/*/*.arrays"))


def test_clear_removes_every_cache_and_no_result(caches: Path) -> None:
    """Shards that wait for their upload are results; assets come back when they are used."""
    assert CliRunner().invoke(cache, ["clear"]).exit_code == 0
    assert not list((caches / "gen-data").glob("format-*"))
    assert (caches / "gen-data/staging/s3/shard/image.png").stat().st_size == 1000
    assert len(open_library().mesh("mug?seed=1").faces) > 0
    assert list((caches / "gen-data").glob("format-*/*/*.arrays"))


def test_an_unknown_name_is_refused_with_the_known_ones(caches: Path) -> None:
    done = CliRunner().invoke(cache, ["clear", "kernel"])

    assert done.exit_code != 0
    assert "'assets', 'urls', 'samples', 'kernels'" in done.output
    assert (caches / "warp").exists()
