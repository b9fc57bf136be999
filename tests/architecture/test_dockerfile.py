"""The container image: pinned base, no root, no cache of pip. CI builds it where an engine runs."""

import io
import re

from dockerfile_parse import DockerfileParser

from tests.architecture.test_rules import ROOT


def test_the_image_is_pinned_small_and_without_root() -> None:
    parser = DockerfileParser(fileobj=io.BytesIO((ROOT / "Dockerfile").read_bytes()))
    steps = [(step["instruction"], step["value"]) for step in parser.structure]

    assert all(re.fullmatch(r"python:3\.11-slim-\w+", image) for image in parser.parent_images)
    pip = [value for name, value in steps if name == "RUN" and "pip " in value]
    assert pip and all("--no-cache-dir" in value for value in pip)
    last = dict(steps)
    assert last["USER"] not in ("root", "0")
    assert last["ENTRYPOINT"] == '["gen-data"]'
    assert [name for name, _ in steps].index("USER") > max(
        number for number, (name, _) in enumerate(steps) if name == "RUN"
    )
    assert ".git" in (ROOT / ".dockerignore").read_text().splitlines()
