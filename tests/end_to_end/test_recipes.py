"""A data set as a recipe of a few kilobytes, and made again from it."""

import re
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

import gen_data
from gen_data.cli.main import cli
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import AssetError, ConfigError, GenDataError
from gen_data.core.sample import Sample
from gen_data.core.version import __version__
from gen_data.pipeline.pipeline import Pipeline
from gen_data.runner.recipe import checksums_of, describe_plan, read_recipe, recipe_text
from gen_data.runner.store import LocalStore
from tests.end_to_end.conftest import BLOCK, CONFIG, N
from tests.runner.doubles import fake_plan


@pytest.fixture
def reader(author: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of a reader: recipe and meshes; no packs are installed."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "block.obj").write_text(BLOCK)
    (tmp_path / "recipe.yaml").write_bytes((author / "recipe.yaml").read_bytes())
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path / "assets"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def edit(reader: Path, was: str, now: str) -> None:
    """Replace the first text that fits a pattern."""
    path = reader / "recipe.yaml"
    text, count = re.subn(was, now, path.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    path.write_text(text)


def refused(reader: Path, kind: type[GenDataError], code: int, **options: Any) -> list[str]:
    """Lines of the error of a pull, after which nothing is sealed."""
    with pytest.raises(kind) as error:
        gen_data.pull("recipe.yaml", out="out", workers=0, **options)
    assert error.value.exit_code == code
    assert not (reader / "out" / "manifest.json").exists()
    return str(error.value).splitlines()


def sums(folder: Path) -> bytes:
    return (folder / "SHA256SUMS").read_bytes()


def test_a_recipe_gives_the_same_files(author: Path, reader: Path) -> None:
    summary = gen_data.pull("recipe.yaml", workers=0)

    assert sums(reader / "out" / "tiny") == sums(author / "set")
    assert gen_data.recipe("out/tiny") == (author / "recipe.yaml").read_text()
    assert gen_data.pull("recipe.yaml", workers=0).already_complete
    assert summary.made == N


@pytest.mark.slow
def test_neither_workers_nor_the_order_of_shards_matter(author: Path, reader: Path) -> None:
    """The last shard by one process, the others by two."""
    first = gen_data.pull("recipe.yaml", out="out", workers=1, shards=(2, 3))
    gen_data.pull("recipe.yaml", out="out", workers=2)

    assert (first.shards_left, first.dataset_id) == (2, "")
    assert sums(reader / "out") == sums(author / "set")


@pytest.mark.slow
def test_parts_are_merged_to_the_same_files(author: Path, reader: Path) -> None:
    gen_data.pull("recipe.yaml", out="a", workers=0, shards=(1, 3))
    gen_data.pull("recipe.yaml", out="b", workers=0, shards=(0, 1))
    cli.main(["merge", "a", "b", "--out", "out", "-w", "0"], standalone_mode=False)

    assert sums(reader / "out") == sums(author / "set")


def test_commands_print_and_prove(
    author: Path, reader: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cli.main(["recipe", str(author / "set")], standalone_mode=False)
    assert capsys.readouterr().out == (author / "recipe.yaml").read_text()

    cli.main(["pull", "recipe.yaml", "-w", "0", "--out", "out"], standalone_mode=False)
    identity = read_recipe(reader / "recipe.yaml").recipe.dataset_id
    assert capsys.readouterr().out == f"out: all shards are equal to the recipe; id {identity}\n"


def test_the_recipe_of_a_configuration_has_all_but_digests_of_results(
    author: Path, reader: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its data set has the recipe of the author, with them."""
    (reader / "tiny.yaml").write_text(CONFIG)
    text = gen_data.recipe("tiny.yaml", N)
    (reader / "recipe.yaml").write_text(text)

    cli.main(["pull", "recipe.yaml", "-w", "0", "--out", "out"], standalone_mode=False)

    assert "# Nothing was generated yet" in text
    assert {*parse_yaml((author / "recipe.yaml").read_text(), "r").entries} - {
        *parse_yaml(text, "r").entries
    } == {"dataset_id", "files", "shards", "labels"}
    assert "the recipe names no digests to compare with" in capsys.readouterr().out
    assert gen_data.recipe("out") == (author / "recipe.yaml").read_text()


def test_all_other_versions_packs_and_assets_are_named_at_once(reader: Path) -> None:
    edit(reader, r'numpy: ".*"', 'numpy: "2.2.6"')
    edit(reader, "scipy: .*", "scipy: absent")
    edit(reader, "packs: {}", 'packs: {people: "1.2 0123456789abcdef"}')
    edit(reader, 'meshes: ""', "meshes: https://example.org/meshes.zip")
    (reader / "meshes" / "block.obj").unlink()
    (reader / "meshes").rmdir()

    lines = refused(reader, AssetError, 3)

    assert [re.sub(r"^recipe\.yaml:\d+:\d+: ", "", line) for line in lines] == [
        f"versions.numpy: 2.2.6 made it, {installed('numpy')} is here; pip install 'numpy==2.2.6'",
        f"versions.scipy: absent made it, {installed('scipy')} is here; pip uninstall scipy",
        "assets.packs.people: is missing; gen-data assets install people",
        f"config.assets.folders[0]: there is no folder {reader / 'meshes'}; get it from "
        "https://example.org/meshes.zip",
        "4 difference(s); nothing was generated",
        "  --semantic accepts other versions, and compares labels only",
    ]
    assert not (reader / "out").exists()


def installed(package: str) -> str:
    from importlib.metadata import version

    return version(package)


def test_another_version_alone_has_the_exit_code_of_determinism(reader: Path) -> None:
    edit(reader, "gen-data: .*", 'gen-data: "9.8.7"')

    lines = refused(reader, gen_data.DeterminismError, 5)

    assert f"versions.gen-data: 9.8.7 made it, {__version__} is here; install" in lines[0]


@pytest.mark.parametrize(("change", "fact"), [
    (lambda mesh: mesh.write_text(BLOCK.replace(".1", ".2")), "own.user/block: was changed"),
    (lambda mesh: mesh.rename(mesh.with_name("other.obj")), "own.user/block: is missing"),
    (lambda mesh: mesh.with_name("new.obj").write_text(BLOCK), "own: lacks user/new, which"),
])  # fmt: skip
def test_a_mesh_of_the_author_that_is_another_one_is_named(
    reader: Path, change: Any, fact: str
) -> None:
    change(reader / "meshes" / "block.obj")

    lines = refused(reader, AssetError, 3)

    assert f"assets.{fact}" in lines[0]
    assert re.match(r"recipe\.yaml:\d+:\d+: ", lines[0])


def test_a_shard_that_differs_is_named_and_nothing_is_sealed(author: Path, reader: Path) -> None:
    """Again by the same command, which finds it on the disk."""
    edit(reader, read_recipe(reader / "recipe.yaml").recipe.shards[1], "f" * 64)

    for _ in range(2):
        lines = refused(reader, gen_data.DeterminismError, 5)
        assert lines[0].startswith("shards/000001: differs from the recipe in an image")


@pytest.mark.slow
@pytest.mark.parametrize("out", ["out", "memory://recipes/set"])
def test_a_finished_data_set_is_proven_again(reader: Path, out: str) -> None:
    """In a folder and in object storage."""
    recipe = read_recipe(reader / "recipe.yaml").recipe
    made = gen_data.pull("recipe.yaml", out=out, workers=0)
    again = gen_data.pull("recipe.yaml", out=out, workers=0)
    assert (made.dataset_id, again.already_complete) == (recipe.dataset_id, True)

    edit(reader, recipe.labels[2], "a" * 64)
    with pytest.raises(gen_data.VerificationError, match=r"shards/000002/labels\.jsonl: differs"):
        gen_data.pull("recipe.yaml", out=out, workers=0, semantic=True)
    edit(reader, recipe.dataset_id, "a" * 64)
    with pytest.raises(gen_data.DeterminismError, match=f"id {recipe.dataset_id}; expected aaa"):
        gen_data.pull("recipe.yaml", out=out, workers=0)
    edit(reader, recipe.shards[1], "f" * 64)
    with pytest.raises(gen_data.DeterminismError, match="shards/000001: differs from the recipe"):
        gen_data.pull("recipe.yaml", out=out, workers=0)


def test_the_files_of_the_author_name_sample_and_field(author: Path, reader: Path) -> None:
    gen_data.generate(author / "tiny.yaml", N, out=reader / "author", seed=4, workers=0)
    edit(reader, read_recipe(reader / "recipe.yaml").recipe.shards[0], "f" * 64)

    lines = refused(reader, gen_data.DeterminismError, 5, against="author")

    assert lines[-1].startswith("  sample 0: first difference in stage scene: ")


def test_labels_that_differ_are_named(reader: Path) -> None:
    record, labels = (getattr(read_recipe(reader / "recipe.yaml").recipe, k)[2]
                      for k in ("shards", "labels"))  # fmt: skip
    edit(reader, labels, "a" * 64)
    lines = refused(reader, gen_data.VerificationError, 7, semantic=True)
    assert lines == ["shards/000002/labels.jsonl: differs from the recipe"]

    edit(reader, record, "f" * 64)
    lines = refused(reader, gen_data.DeterminismError, 5)
    assert lines[0].startswith("shards/000002/labels.jsonl: differs from the recipe")


@pytest.mark.parametrize(("was", "fact"), [
    (r"README.md: \S+", "README.md: differs from the recipe"),
    (r"dataset_id: \S+", "an exported file differs, or dataset_id of the recipe was changed"),
])  # fmt: skip
def test_files_outside_of_shards_are_compared(reader: Path, was: str, fact: str) -> None:
    key = was.partition(":")[0]
    edit(reader, was, f'{key}: "{"3" * 64}"')
    edit(reader, "dataset_id: .*", f'dataset_id: "{"3" * 64}"')

    assert refused(reader, gen_data.DeterminismError, 5)[0].startswith(fact)


def test_other_versions_are_accepted_if_labels_are_equal(author: Path, reader: Path) -> None:
    edit(reader, "numpy: .*", 'numpy: "2.2.6"')
    edit(reader, read_recipe(reader / "recipe.yaml").recipe.shards[0], "f" * 64)

    with pytest.warns(gen_data.ConfigWarning, match=r"numpy: 2\.2\.6 made it"):
        gen_data.pull("recipe.yaml", workers=0, semantic=True, against=author / "set", out="out")

    assert sums(reader / "out") == sums(author / "set")


@pytest.mark.slow
@pytest.mark.parametrize(("change", "is_similar"), [(1, True), (3, False)])
def test_images_are_compared_with_those_of_the_author(
    reader: Path, change: int, is_similar: bool
) -> None:
    """Every byte is changed by one or three levels; the bound is one in the mean."""
    import cv2

    gen_data.pull("recipe.yaml", out="author", workers=0)
    path = reader / "author/shards/000000/color/rgb/000000001.png"
    image = cv2.imread(str(path))
    assert image is not None
    cv2.imwrite(str(path), image - change * (2 * (image > 127).astype("u1") - 1))

    try:
        gen_data.pull("recipe.yaml", out="out", workers=0, semantic=True, against="author")
        found = ""
    except gen_data.VerificationError as error:
        found = str(error)

    assert found == ("" if is_similar else (
        "out/shards/000000/color/rgb/000000001.png: differs by 3 of 255 levels in the mean; "
        "expected at most 1"
    ))  # fmt: skip


EDITS = {
    "n": ("^n: 5", "n: 6"), "name": ("^name: tiny", "name: small"),
    "config.randomizers": (r"\[0.8, 1\]", "[0.8, 1.5]"),
    "config.sensors": (r"\[48, 32\]", "[48, 33]"), "config.splits": ("train: 1", "train: 2"),
}  # fmt: skip


@pytest.mark.parametrize("field", EDITS)
def test_an_edited_field_is_named_with_its_place(reader: Path, field: str) -> None:
    edit(reader, *EDITS[field])
    text = (reader / "recipe.yaml").read_text().splitlines()
    line = next(k for k, one in enumerate(text, 1) if one.lstrip().startswith(
        f"{field.rpartition('.')[2]}:"))  # fmt: skip
    checksum = read_checksum(reader, field)

    error = refused(reader, ConfigError, 2)

    column = 3 if "." in field else 1
    assert error[0] == (
        f"recipe.yaml:{line}:{column}: {field}: was edited; expected the value with the checksum "
        f"{checksum}"
    )
    assert not (reader / "out").exists()


def read_checksum(reader: Path, field: str) -> str:
    plain = parse_yaml((reader / "recipe.yaml").read_text(), "r").plain()
    return str(plain["checksums"][field])


@pytest.mark.parametrize(("was", "now", "fact"), [
    ("^format: 1", "format: 2", "format: 2 is newer than this gen-data; expected 1: update"),
    ("^format: 1", "format: one", "format: one is not a format of recipes; expected 1"),
    ("^format: 1\n", "", "format: missing; expected a recipe, as gen-data recipe prints"),
    ("^n: 5", "n: five", "n: expected a whole number"),
    ("^seed: 3", "sede: 3", "sede: unknown key 'sede'"),
    (r"^shards:\n.*", "shards:", "shards: 2 digests; expected 3, one for each shard"),
    ("^name: tiny", "name: ../tiny", "name: '../tiny' cannot name a file"),
    ("numpy: .*", "numpy: '1; touch marker'", "versions.numpy: '1; touch marker' does not"),
    ("numpy:", "--index-url:", "versions.--index-url: '--index-url' does not match"),
    ("^config:\n", "config:\n  extends: a.yaml\n", "checksums: lacks 'config.extends'"),
])  # fmt: skip
def test_a_wrong_recipe_is_an_error_with_its_place(
    reader: Path, was: str, now: str, fact: str
) -> None:
    edit(reader, was, now)

    lines = refused(reader, ConfigError, 2)

    assert any(re.match(rf"recipe\.yaml:\d+:\d+: {re.escape(fact)}", line) for line in lines), lines
    assert {path.name for path in reader.iterdir()} == {"meshes", "recipe.yaml"}


def test_a_recipe_that_is_cut_off_anywhere_is_one_error(reader: Path) -> None:
    path = reader / "recipe.yaml"
    whole = path.read_bytes()
    for length in [*range(0, len(whole) - 1, 61), len(whole) - 3]:
        path.write_bytes(whole[:length])
        with pytest.raises(ConfigError) as error:
            read_recipe(path)
        lines = str(error.value).splitlines()
        places = [line for line in lines if line.startswith(str(path))]
        assert len(places) == 1, (length, lines)
        assert re.match(r"\S+recipe\.yaml:\d+:\d+: ", lines[0]), (length, lines)


def rewritten(reader: Path, **config: Any) -> None:
    """Write the recipe with other values of the configuration and fitting checksums."""
    values = parse_yaml((reader / "recipe.yaml").read_text(), "r").plain()
    values["config"] |= config
    del values["checksums"]
    (reader / "recipe.yaml").write_text(recipe_text(values))


@pytest.mark.parametrize("kind", ["absolute", "parent", "link", "home"])
def test_folders_outside_of_the_recipes_own_are_not_read(reader: Path, kind: str) -> None:
    outside = reader.parent / f"{reader.name}-private"
    outside.mkdir()
    (outside / "secret.obj").write_text(BLOCK)
    (reader / "link").symlink_to(outside)
    name = {"absolute": str(outside), "parent": f"../{outside.name}", "link": "link", "home": "~"}
    rewritten(reader, assets={"folders": [name[kind]]})

    lines = refused(reader, AssetError, 3)

    assert f"is outside of {reader}; --trust reads it" in lines[0]
    assert not (reader / "out").exists()


def test_trust_reads_such_a_folder(reader: Path) -> None:
    """The mesh of another name is found, and differs from the recipe's."""
    outside = reader.parent / f"{reader.name}-trusted"
    outside.mkdir()
    (outside / "secret.obj").write_text(BLOCK)
    rewritten(reader, assets={"folders": [str(outside)]})

    lines = refused(reader, AssetError, 3, trust=True)

    assert "assets.own.user/block: is missing" in lines[0]


@pytest.mark.parametrize("config", [
    {"extends": "marker.yaml"}, {"elements": {"clutter": {"count": 1}}, "template": "marker.yaml"},
    {"sensors": [{"type": "lidar", "name": "top", "model": "marker.yaml"}]},
])  # fmt: skip
def test_a_configuration_that_names_further_files_is_refused(
    reader: Path, config: dict[str, Any]
) -> None:
    (reader / "marker.yaml").write_text("{like: VLP-16}")
    rewritten(reader, **config)

    refused(reader, ConfigError, 2)

    assert {path.name for path in reader.iterdir()} == {"meshes", "recipe.yaml", "marker.yaml"}


def test_a_recipe_cannot_have_the_name_of_a_plan(reader: Path) -> None:
    (reader / "recipe.yaml").rename(reader / "plan.json")

    with pytest.raises(ConfigError, match="is the name of plans; expected a recipe"):
        gen_data.pull("plan.json", workers=0)


def test_values_come_back_from_the_file() -> None:
    """Texts that look like numbers or that YAML escapes; whole numbers with a fraction."""
    config = {
        "seed": 0,
        "texts": ["0o7", "1e3", "yes", "~", "a: b", "1:30", "", "ä 🚗", "#", "x\u2028y", "\ufeff"],
        "numbers": [5, 5.0, 1e-05, 1e16, -0.0, 0.1],
        "1": {"nested key: odd": [[1, 2], [{"a": []}]], "none": None, "true": True},
        "long": [{"a" * 40: "b" * 80}, ["c" * 90, "d"]],
    }
    values = describe_plan(fake_plan(), ["Apache-2.0"]) | {"config": config}

    plain = parse_yaml(recipe_text(values), "recipe.yaml").plain()

    assert repr(plain) == repr(values | {"checksums": checksums_of(values)})


def test_versions_become_requirements_for_pip(reader: Path) -> None:
    edit(reader, "scipy: .*", "scipy: absent")

    cli.main(["recipe", "recipe.yaml", "--lock", "requirements.txt"], standalone_mode=False)

    lines = (reader / "requirements.txt").read_text().splitlines()
    assert f"made with gen-data {__version__}, which comes from its repository" in lines[0]
    found = {r.name: str(r.specifier) for r in map(Requirement, lines[1:])}
    versions = read_recipe(reader / "recipe.yaml").recipe.versions
    assert versions.pop("gen-data") and versions["scipy"] == "absent"
    here = {name: version for name, version in versions.items() if version != "absent"}
    assert found == {name: f"=={version}" for name, version in here.items()}


@pytest.mark.slow
def test_only_a_finished_and_intact_data_set_has_a_recipe(author: Path, reader: Path) -> None:
    gen_data.pull("recipe.yaml", out="out", workers=0, shards=(0, 1))
    with pytest.raises(gen_data.VerificationError, match="not a finished data set"):
        gen_data.recipe("out")

    gen_data.pull("recipe.yaml", out="out", workers=0)
    LocalStore(reader / "out").record_path(1).write_text("{}")
    with pytest.raises(gen_data.StorageError, match=r"shards/000001\.json"):
        gen_data.recipe("out")
    with pytest.raises(ConfigError, match="states n, seed and all values itself"):
        gen_data.recipe(author / "set", 7)
    with pytest.raises(ConfigError, match="--n is missing"):
        gen_data.recipe(author / "tiny.yaml")


def test_samples_that_failed_are_part_of_the_recipe(
    author: Path, reader: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Pipeline.sample

    def sample(self: Pipeline, index: int) -> Sample:
        if index == 1:
            raise ZeroDivisionError("in a plug-in")
        return whole(self, index)

    monkeypatch.setattr(Pipeline, "sample", sample)
    gen_data.generate(author / "tiny.yaml", N, out="lacking", workers=0, skip_failed=True)
    (reader / "recipe.yaml").write_text(gen_data.recipe("lacking"))

    summary = gen_data.pull("recipe.yaml", out="out", workers=0)

    assert [failure.index for failure in summary.failed] == [1]
    assert read_recipe(reader / "recipe.yaml").recipe.failed == (1,)
    assert sums(reader / "out") == sums(reader / "lacking")


@pytest.mark.slow
def test_the_recipe_of_a_thousand_tables_is_small() -> None:
    """2,968 assets are one digest; the finished data set adds two digests for each of 50 shards."""
    digests = 2 * 50 * len(f'  - "{64 * "0"}"\n')

    assert len(gen_data.recipe("tabletop.yaml", 1000).encode()) + digests < 20_000


@pytest.fixture
def packed(author: Path, reader: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of a reader with a recipe that names a pack, which lies next to it."""
    monkeypatch.setattr("gen_data.packs.own_pack.default_cache_dir", lambda: reader / "cache")
    cli.main(["assets", "pack", "meshes"], standalone_mode=False)
    (reader / "meshes" / "block.obj").unlink()
    (reader / "meshes").rmdir()
    edit(reader, 'meshes: ""', "meshes: https://example.org/meshes.zip")
    text = gen_data.recipe("recipe.yaml", packs=["meshes.zip"])
    (reader / "recipe.yaml").write_text(text)
    return reader


@pytest.mark.parametrize("name", ["meshes", "../meshes", "~/meshes"])
def test_a_pack_takes_the_place_of_the_authors_folder(
    author: Path, packed: Path, name: str
) -> None:
    """Wherever the author had it. Once unpacked, the file is not needed any more."""
    if name == "meshes":
        gen_data.pull("recipe.yaml", out="out", workers=0)
        assert sums(packed / "out") == sums(author / "set")
        (packed / "meshes.zip").unlink()
        assert gen_data.open("recipe.yaml").categories == ("meshes",)
        return
    plain = read_recipe(packed / "recipe.yaml").values()
    plain["config"]["assets"]["folders"] = [name]
    for key in ("urls", "archives"):
        plain["assets"][key] = {name: plain["assets"][key].pop("meshes")}
    (packed / "recipe.yaml").write_text(recipe_text(plain))

    assert gen_data.open("recipe.yaml").categories == ("meshes",)


def test_a_pack_is_named_by_a_finished_data_set_and_a_configuration_too(
    author: Path, packed: Path
) -> None:
    made = gen_data.recipe(author / "set", packs=["meshes.zip"])
    planned = gen_data.recipe(author / "tiny.yaml", N, packs=["meshes.zip"])

    digests = parse_yaml((packed / "recipe.yaml").read_text(), "r").plain()["assets"]["archives"]
    for text in (made, planned):
        assert parse_yaml(text, "r").plain()["assets"]["archives"] == digests
    with pytest.raises(ConfigError, match=r"other\.zip: has the name of no folder .* meshes\.zip"):
        gen_data.recipe(author / "set", packs=["other.zip"])
    (packed / "meshes.zip").unlink()
    with pytest.raises(ConfigError, match=r"meshes\.zip: No such file"):
        gen_data.recipe(author / "set", packs=["meshes.zip"])


@pytest.mark.parametrize(
    ("data", "fact"),
    [
        (None, "is missing"),
        (b"", r"was changed or cut off: its digest is e3b0c44298fc1c14, expected \w{16}"),
        (b"PK\x03\x04", r"was changed or cut off: its digest is \w{16}, expected \w{16}"),
    ],
)
def test_a_pack_that_does_not_fit_is_one_line_with_its_remedy(
    packed: Path, data: bytes | None, fact: str
) -> None:
    if data is None:
        (packed / "meshes.zip").unlink()
    else:
        (packed / "meshes.zip").write_bytes(data)

    line, end = refused(packed, AssetError, 3)

    assert re.fullmatch(
        rf"recipe\.yaml:\d+:\d+: config\.assets\.folders\[0\]: {packed}/meshes\.zip: {fact}; "
        r"get it from https://example\.org/meshes\.zip",
        line,
    )
    assert end == "1 difference(s); nothing was generated"


def test_a_pack_with_other_meshes_names_them(packed: Path) -> None:
    """The author packed another state of the folder."""
    (packed / "other").mkdir()
    (packed / "other" / "block.obj").write_text(BLOCK.replace(".1", ".2"))
    cli.main(["assets", "pack", "other", "-o", "meshes.zip", "--force"], standalone_mode=False)
    text = gen_data.recipe("recipe.yaml", packs=["meshes.zip"])
    (packed / "recipe.yaml").write_text(text)

    assert "own.user/block: was changed" in refused(packed, AssetError, 3)[0]
