"""A sentence becomes a configuration, whatever a model replies."""

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import jsonschema
import pytest

import gen_data
from gen_data.assets.paths import may_fetch
from gen_data.cli.main import cli
from gen_data.core.errors import ConfigError, SampleError, StorageError
from gen_data.lab.write.language_model import ModelServer
from gen_data.lab.write.vocabulary import (
    PROMPT_CHARS_MAX,
    Vocabulary,
    choose_vocabulary,
    rank,
    reply_schema,
)
from gen_data.lab.write.write import (
    CONFIG_CHARS_MAX,
    ERRORS_CHARS_MAX,
    Written,
    as_yaml,
    write_config,
)
from tests.write.scripted import Scripted, serve

SENTENCE = "Mugs on a table, seen from above."
TINY: dict[str, Any] = {
    "elements": [
        {"name": "table", "type": "surface", "asset": "table", "top_size_m": [1, 1]},
        {"name": "mugs", "type": "objects", "on": "table", "assets": {"ids": ["mug"]}, "count": 1},
    ],
    "randomizers": [{"type": "camera_pose", "name": "orbit", "distance_m": {"uniform": [0.8, 1]}}],
    "sensors": [{"type": "rgb_camera", "name": "color", "size_px": [48, 32]}],
    "annotations": ["boxes2d"],
    "exporters": [{"type": "coco"}],
}
VALID = json.dumps(TINY)
VOCABULARY = Vocabulary("rules", {"type": "object"})
HEAD = f"# Written by gen-data write, from this sentence:\n# {SENTENCE}\n"


def changed(**values: Any) -> str:
    return json.dumps(TINY | values)


def with_sensor(**values: Any) -> str:
    return changed(sensors=[{**TINY["sensors"][0], **values}])


def ask(script: Scripted, out: Path, **options: Any) -> Written:
    return write_config(SENTENCE, ModelServer(script.url), out, vocabulary=VOCABULARY, **options)


def errors_of(reply: str, out: Path) -> str:
    """The errors that a model is told of its only reply."""
    told: list[str] = []
    with serve([reply]) as script, pytest.raises(ConfigError, match=r"\(replies: 1\); nothing was"):
        ask(script, out, turns=1, on_errors=told.append)
    (errors,) = told
    return errors


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """File to write, in a folder that stays empty."""
    folder = tmp_path / "chosen"
    folder.mkdir()
    return folder / "scene.yaml"


@pytest.mark.parametrize(
    "reply",
    [
        VALID,
        f"Here it is:\n```json\n{VALID}\n```\nEnjoy!",
        f"<think>```yaml\nwrong: [\n```</think>\n{VALID}",
    ],
)
def test_a_valid_reply_is_taken(out: Path, reply: str) -> None:
    with serve([reply]) as script:
        written = ask(script, out)

    assert written.turns == len(script.requests) == 1
    assert written.text.startswith(HEAD)
    assert written.config.resolved["sensors"][0]["size_px"] == [48, 32]
    assert list(out.parent.iterdir()) == []
    assert [m["content"] for m in script.requests[0]["messages"]] == ["rules", SENTENCE]


def test_errors_go_back_with_the_lines_that_the_model_sees(out: Path) -> None:
    """A message of the second request holds the file whose line the error names."""
    with serve([with_sensor(size_px=[48]), changed(randomisers=[]), VALID]) as script:
        written = ask(script, out)

    assert written.turns == 3
    _, _, reply, errors = (m["content"] for m in script.requests[1]["messages"])
    place, _, fact = errors.partition(": sensors[0].size_px: ")
    file, line, column = place.split(":")
    shown = reply.splitlines()[int(line) - 1]
    assert (file, shown[int(column) - 1 :]) == ("scene.yaml", "[48]}]")
    assert "expected" in fact
    assert "unknown key 'randomisers'" in script.requests[2]["messages"][3]["content"]
    assert len(script.requests[2]["messages"]) == 4  # The latest reply only.


def test_a_stubborn_model_is_asked_a_few_times(out: Path) -> None:
    with serve([with_sensor(size_px=[48])]) as script, pytest.raises(ConfigError) as error:
        ask(script, out, turns=3)

    assert len(script.requests) == 3
    assert str(error.value) == "no valid configuration (replies: 3); nothing was written"
    assert max(len(json.dumps(request)) for request in script.requests) < 2 * CONFIG_CHARS_MAX


def test_what_cannot_be_drawn_goes_back_too(out: Path) -> None:
    def show(config: object) -> None:
        raise SampleError("sample 0: the mug fell off the table")

    with serve([VALID]) as script, pytest.raises(ConfigError):
        ask(script, out, turns=2, show=show)

    assert "the mug fell off" in script.requests[1]["messages"][3]["content"]


@pytest.mark.parametrize(
    ("reply", "fact"),
    [
        ("I am sorry, I cannot do that.", "scene.yaml:1:1: expected a mapping of settings, got"),
        ("<!DOCTYPE html><html>", "scene.yaml:1:1: expected a mapping of settings, got"),
        ("\x00\x01", "scene.yaml:1:1: "),
        ("\ufffd\ufffd: \ufffd", "template: expected the name of a template"),
        ("{" * 5000, "nested deeper than 32 levels"),
        ("a: &a [b, b]\nb: !!python/object/apply:os.system [touch marker]", "scene.yaml:2:4: "),
        ("x" * (CONFIG_CHARS_MAX + 1), f"expected {CONFIG_CHARS_MAX}"),
        (changed(seed="x" * 3000), "seed: "),
        (with_sensor(size_px=[8000, 8000]), "images have 64 megapixels a sample; expected at most"),
    ],
)
def test_a_reply_that_is_no_configuration_is_an_error(out: Path, reply: str, fact: str) -> None:
    errors = errors_of(reply, out)

    assert fact in errors
    assert len(errors) <= ERRORS_CHARS_MAX
    assert list(out.parent.iterdir()) == []


NAMES = ("PRIVATE/secret.yaml", "../private/secret.yaml", "secret.yaml", "~/secret.yaml")
"""Of a secret file in ways that a reply may write them; PRIVATE is the path of its folder."""
WATCHED = ("open", "socket.connect", "subprocess.Popen", "os.system")
_watched: list[tuple[str, str]] | None = None


def _watch(event: str, arguments: tuple[Any, ...]) -> None:
    if _watched is not None and event in WATCHED:
        _watched.append((event, str(arguments[1] if event == "socket.connect" else arguments[0])))


@pytest.fixture
def watched() -> Iterator[list[tuple[str, str]]]:
    """Files that are opened, hosts that are connected to, and programs that are started."""
    global _watched  # noqa: PLW0603
    if not getattr(sys, "_gen_data_watch", False):
        sys.addaudithook(_watch)
        sys._gen_data_watch = True  # type: ignore[attr-defined]
    _watched = []
    yield _watched
    _watched = None


@pytest.mark.parametrize(
    "reply",
    [
        *(json.dumps({"extends": name}) for name in (*NAMES, "https://127.0.0.1:1/a.yaml")),
        changed(elements={}, template="PRIVATE/secret.yaml"),
        changed(elements={}, template="secret"),
        changed(assets={"folders": ["PRIVATE"]}),
        changed(assets={"folders": ["https://127.0.0.1:1/meshes"]}),
        *(changed(sensors=[{"type": "lidar", "name": "top", "model": name}]) for name in NAMES),
        *(with_sensor(calibration=name) for name in NAMES),
        with_sensor(calibration={"file": "x/../../private/secret.yaml"}),
        with_sensor(name="../private/camera"),
        changed(exporters=[{"type": "coco", "name": "../../private"}]),
        *(changed(randomizers=[{"type": "arm_task", "tasks": name}]) for name in NAMES),
        *(changed(elements=[{"name": "stage", "type": "usd_stage", "asset": f"user/{name}"}])
          for name in NAMES),
        *(changed(elements=[{"name": "m", "type": "objects", "assets": {"ids": [name]}}])
          for name in NAMES),
    ],
)  # fmt: skip
def test_no_reply_reads_or_writes_other_files_or_asks_other_hosts(
    tmp_path: Path,
    out: Path,
    watched: list[tuple[str, str]],
    reply: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A secret lies next to the chosen file, in another folder, at home and where the user is."""
    private = tmp_path / "private"
    private.mkdir()
    for folder in (private, out.parent):
        (folder / "secret.yaml").write_text("password: hunter2\n")
    monkeypatch.setenv("HOME", str(private))
    monkeypatch.chdir(private)

    with serve([reply.replace("PRIVATE", str(private))]) as script:
        told: list[str] = []
        watched.clear()
        with pytest.raises(ConfigError, match="nothing was written"):
            ask(script, out, turns=1, on_errors=told.append)
        seen = list(watched)

    assert "hunter2" not in told[0]
    assert [what for event, what in seen if event == "open" and "secret" in what] == []
    assert {what for event, what in seen if event == "socket.connect"} == {
        str(("127.0.0.1", int(script.url.split(":")[2].removesuffix("/v1"))))
    }
    assert not {"subprocess.Popen", "os.system"} & {event for event, _ in seen}
    assert [path.name for path in out.parent.iterdir()] == ["secret.yaml"]
    assert [path.name for path in private.iterdir()] == ["secret.yaml"]


def test_a_shipped_name_next_to_a_file_of_that_name_is_refused(out: Path) -> None:
    """The written file would mean another one than was shown."""
    (out.parent / "tabletop.yaml").write_text("template: other")

    assert errors_of('{"extends": "tabletop.yaml"}', out).splitlines() == [
        "scene.yaml:3:10: extends: names a file next to scene.yaml; expected shipped ones only",
        "      3 | extends: tabletop.yaml",
        "        |          ^",
    ]


def test_nothing_is_fetched_meanwhile(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEN_DATA_OFFLINE", "0")
    found: list[bool] = []
    with serve([VALID]) as script:
        ask(script, out, show=lambda config: found.append(may_fetch()))

    assert found == [False]
    assert os.environ["GEN_DATA_OFFLINE"] == "0"


@pytest.mark.parametrize("sentence", ["", " \n ", "x" * 2001])
def test_a_sentence_has_a_length(out: Path, sentence: str) -> None:
    with pytest.raises(ConfigError, match="expected a sentence of 1 to 2000 characters"):
        write_config(sentence, ModelServer("http://127.0.0.1:1"), out)


def test_a_sentence_stays_a_comment() -> None:
    text = as_yaml("{seed: 3}", "a\u2028b", "scene.yaml")

    assert text == "# Written by gen-data write, from this sentence:\n# a b\nseed: 3\n"


def test_rare_shared_words_count_most() -> None:
    texts = {
        "a": "a camera on a table",
        "b": "a camera on a table with mugs",
        "c": "a camera",
        "d": "a camera in a street",
    }

    assert rank("mugs before a camera", texts)[0] == "b"
    assert rank("a street", texts)[0] == "d"
    assert rank("", texts) == list(texts)


@pytest.mark.slow
def test_the_schema_of_replies_accepts_valid_ones() -> None:
    """And no files of the user, and no names that are not shipped."""
    schema = reply_schema(["elements/surface", "sensors/rgb_camera", "randomizers/camera_pose"])
    judge = jsonschema.Draft202012Validator(schema)

    judge.check_schema(schema)
    assert judge.is_valid(TINY)
    assert judge.is_valid({"extends": "tabletop.yaml", "randomizers": [{"name": "orbit"}]})
    for wrong in (
        {"assets": {"folders": ["x"]}},
        {"extends": "other.yaml"},
        {"template": "other"},
        {"sensors": [{"type": "telescope"}]},
        {"sensors": [{"type": "rgb_camera", "size_px": "large"}]},
    ):
        assert not judge.is_valid(wrong), wrong
    assert len(json.dumps(schema)) < 60_000


@pytest.mark.slow
def test_the_prompt_has_the_fitting_words_within_its_bound() -> None:
    told = choose_vocabulary(SENTENCE)

    assert len(told.prompt) <= PROMPT_CHARS_MAX
    assert len(json.dumps(told.schema)) < 100_000
    for name in ("tabletop.yaml", "uniform_integer", "rgb_camera", "camera_pose", "boxes2d"):
        assert name in told.prompt
    assert "first\nmug (" in told.prompt


@pytest.mark.slow
def test_the_command_shows_before_it_writes(
    out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Errors, plan and contact sheet; then the file, whose samples can be generated."""
    monkeypatch.chdir(out.parent)
    monkeypatch.setenv("OTHER_KEY", "sk-secret")
    with serve(["nothing", VALID]) as script:
        words = ["write", SENTENCE, "--url", script.url, "--samples", "1"]
        monkeypatch.setattr("click.confirm", lambda text: False)
        with pytest.raises(click.Abort):
            cli.main(words, standalone_mode=False)
        assert [path.name for path in out.parent.iterdir()] == ["scene.png"]

        with pytest.raises(StorageError, match=r"scene\.png: exists; choose another --out, or rep"):
            cli.main([*words, "--yes"], standalone_mode=False)
        cli.main([*words, "--yes", "--force", "--key-variable", "OTHER_KEY"], standalone_mode=False)
        with pytest.raises(StorageError, match=r"scene\.yaml: exists"):
            cli.main([*words, "--yes"], standalone_mode=False)

    printed = capsys.readouterr()
    assert "sk-secret" not in printed.out + printed.err + out.read_text()
    assert script.heads[-1]["Authorization"] == "Bearer sk-secret"
    assert "expected a mapping of settings" in printed.err
    assert "scene.yaml: written (replies: 1)" in printed.out
    assert (out.parent / "scene.png").read_bytes().startswith(b"\x89PNG")
    assert gen_data.Dataset(out, n=1).categories == ("mug",)


@pytest.mark.parametrize(
    ("options", "fact"),
    [
        ([], "expected one of --url and --command"),
        (["--url", "http://h", "--command", "cat"], "expected one of --url and --command"),
        (["--command", "'"], "--command: No closing quotation"),
        (["--url", "http://h", "--out", "scene.json"], "expected a name that ends with .yaml"),
    ],
)
def test_wrong_options_are_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], fact: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=fact):
        cli.main(["write", SENTENCE, *options], standalone_mode=False)
