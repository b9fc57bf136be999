"""Safe parsing of XML of others."""

from typing import Any
from xml.parsers import expat

import pytest

from gen_data.core.errors import AssetError
from gen_data.core.safe_xml import format_position, parse_xml

CREATE = expat.ParserCreate


class Strict:
    """Hands documents of version 1 to Expat, and refuses others, as Expat of Debian 13 does."""

    def __init__(self) -> None:
        self.__dict__["own"] = CREATE()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["own"], name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.__dict__["own"], name, value)

    def Parse(self, data: bytes, is_final: bool) -> None:  # noqa: N802  (the parser's own name)
        if b"version" in data[:40] and b"1." not in data[:40]:
            raise expat.ExpatError("XML declaration not well-formed")
        self.__dict__["own"].Parse(data, is_final)


@pytest.mark.parametrize("start", [
    b'<?xml version="0.0" ?>', b"<?xml version='2'?>", b'\xef\xbb\xbf<?xml version = "0.0"?>',
    b'<?xml version="1.0"?>', b'<?xml version="1.1" encoding="utf-8"?>', b"",
])  # fmt: skip
def test_any_version_is_read_as_version_1(start: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of pybullet declare version 0.0, which newer parsers refuse; lines and columns stay."""
    monkeypatch.setattr(expat, "ParserCreate", Strict)
    text = start + b'\n<robot name="a">\n  <link/></robot>'

    root = parse_xml(text, "a.urdf", "robot", "a URDF", 9)

    assert root.get("name") == "a"
    assert format_position(root[0]) == ":3:3"


def test_malformed_documents_are_refused_by_name() -> None:
    with pytest.raises(AssetError, match=r"a\.urdf: malformed XML"):
        parse_xml(b"<robot>", "a.urdf", "robot", "a URDF", 9)
