"""Keys that begin with a space, or hold a dot or a line break, are quoted by messages."""

import re
from pathlib import Path

import pytest

from gen_data.api.config import load_config
from gen_data.core.errors import ConfigError

KEYS = (" eed", "a.b", "a\nb")
ENTRIES = {
    "": "{key}: $shared.nothing",
    "elements": "elements: {{{key}: {{asset: mug}}}}",
    "without": "without: {{{key}: [color]}}",
}


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("section", ENTRIES)
def test_an_unusual_key_is_quoted(tmp_path: Path, section: str, key: str) -> None:
    path = tmp_path / "own.yaml"
    quoted = '"' + key.replace("\n", "\\n") + '"'
    base = "template: tabletop" if section == "elements" else "extends: tabletop.yaml"
    path.write_text(f"{base}\n{ENTRIES[section].format(key=quoted)}\n")

    with pytest.raises(ConfigError) as refused:
        load_config(str(path))

    lines = [line for line in str(refused.value).splitlines() if not line.startswith(" ")]
    named = re.escape(section) + re.escape(f"[{key!r}]")
    assert lines
    assert all(re.match(rf"\S+own\.yaml:2:\d+: {named}: ", line) for line in lines), lines


@pytest.mark.parametrize(("text", "message"), [
    ('" lements": []', r"1:1: \[' lements'\]: unknown key"),
    ('{elements: [], defaults: {" prop": {}}}', r"1:27: defaults\[' prop'\]: no element"),
])  # fmt: skip
def test_an_unusual_key_of_a_template_is_quoted(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "table.yaml").write_text(f"{text}\n")
    (tmp_path / "own.yaml").write_text("template: table.yaml\nsensors: [{type: rgb_camera}]\n")

    with pytest.raises(ConfigError, match=rf"table\.yaml:{message}"):
        load_config(str(tmp_path / "own.yaml"))
