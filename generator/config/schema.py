"""JSON Schemas of models: for editors, and for the wording of messages, descriptions, examples."""

from __future__ import annotations

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import pairwise
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from gen_data.config.distributions import DISTRIBUTION_TITLE, Bounds, Distribution
from gen_data.config.yaml_scalars import to_flow_yaml

SHARED_VALUE = "shared_value"
"""Name of the definition for references to shared values."""

_SHARED_VALUE = {
    "description": "A shared value, or the entry that one selects.",
    "anyOf": [
        {"type": "string", "pattern": r"^\$shared\."},
        {"type": "object", "required": ["switch"]},
    ],
}


_WORDS = {
    "boolean": "true or false",
    "integer": "a whole number",
    "number": "a number",
    "string": "a text",
    "object": "a mapping",
    "null": "nothing",
}
_PYTHON_NAMES = {
    "boolean": ("bool",),
    "integer": ("int",),
    "number": ("float",),
    "string": ("str",),
    "array": ("list", "tuple", "set", "frozenset"),
    "object": ("dict",),
}


def to_plain_yaml(value: Any) -> Any:
    """Convert a value of a model to the plain data of its YAML."""
    if isinstance(value, Distribution):
        return value.to_yaml()
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): to_plain_yaml(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain_yaml(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(to_plain_yaml(item) for item in value)
    return value


class _Generator(GenerateJsonSchema):
    """Generator that writes defaults as plain YAML data, and all keys in the order of fields."""

    def encode_default(self, dft: Any) -> Any:
        return to_plain_yaml(dft)

    def sort(self, value: Any, parent_key: str | None = None) -> Any:  # noqa: ARG002
        return value


@cache
def model_schema(model: type[BaseModel]) -> Mapping[str, Any]:
    """JSON Schema of a model as pydantic makes it."""
    return model.model_json_schema(schema_generator=_Generator)


def docstring_summary(model: type) -> str:
    """First paragraph of a class's docstring, on one line."""
    documented = inspect.cleandoc(model.__doc__ or "")
    return documented.partition("\n\n")[0].replace("\n", " ")


def documented_attributes(model: type[BaseModel]) -> dict[str, str]:
    """``{field: text}`` of a class and its bases.

    Texts come from the section ``Attributes:`` and of docstrings below fields.
    """
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if issubclass(base, BaseModel) and base is not BaseModel:
            found |= _attribute_docstrings(base)
            found |= dict(_attributes_section(inspect.cleandoc(base.__doc__ or "")))
    return found


@cache
def _attribute_docstrings(model: type) -> dict[str, str]:
    """Fields with a docstring below them; none for a class without source, as in a notebook."""
    try:
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(model))).body
    except (OSError, SyntaxError):
        return {}
    body = tree.body if isinstance(tree, ast.ClassDef) else []
    found: dict[str, str] = {}
    for field, after in pairwise(body):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            match after:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    found[field.target.id] = " ".join(text.split())
    return found


def _attributes_section(docstring: str) -> Iterator[tuple[str, str]]:
    _, heading, section = docstring.partition("Attributes:\n")
    if not heading:
        return
    section = re.split(r"\n(?=\S)", section)[0]
    for entry in re.split(r"\n(?=\S)", textwrap.dedent(section).strip("\n")):
        names, _, text = entry.partition(":")
        # "width_px, height_px: Size" documents two fields at once.
        for name in names.split(","):
            yield name.strip(), " ".join(text.split())


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema (2020-12) of a model's YAML, with descriptions from docstrings.

    Distributions of one kind share one definition in ``$defs``.
    """
    definitions: dict[str, Any] = {}
    schema: dict[str, Any] = _hoist_distributions(model_schema(model), definitions)
    schema["description"] = docstring_summary(model)
    attributes = documented_attributes(model)
    for name, entry in schema.get("properties", {}).items():
        if name in attributes:
            entry.setdefault("description", attributes[name])
    if definitions:
        schema["$defs"] = dict(sorted({**schema.get("$defs", {}), **definitions}.items()))
    return schema


def with_shared_values(schema: dict[str, Any], constant: Collection[str] = ()) -> dict[str, Any]:
    """Allow references to shared values in the schema of a plug-in.

    Args:
        schema: Schema of a model, definitions included.
        constant: Names of fields that must not depend on shared values.
    """
    wrapped: dict[str, Any] = _allow_shared(schema)
    for name in constant:
        if name in schema.get("properties", {}):
            wrapped["properties"][name] = schema["properties"][name]
    wrapped["$defs"] = {**wrapped.get("$defs", {}), SHARED_VALUE: _SHARED_VALUE}
    return wrapped


def _allow_shared(schema: Any) -> Any:
    if not isinstance(schema, dict):
        return schema
    wrapped = dict(schema)
    for key, part in schema.items():
        if key == "$defs":
            wrapped[key] = {name: _allow_shared(entry) for name, entry in part.items()}
        elif key == "properties":
            wrapped[key] = {name: _or_shared(entry) for name, entry in part.items()}
        elif key in ("items", "additionalProperties"):
            wrapped[key] = _or_shared(part)
        elif key == "prefixItems":
            wrapped[key] = [_or_shared(item) for item in part]
        elif key in ("anyOf", "oneOf"):
            wrapped[key] = [_allow_shared(option) for option in part]
    return wrapped


def _or_shared(schema: Any) -> Any:
    if not isinstance(schema, dict) or "const" in schema:
        return schema
    return {"anyOf": [_allow_shared(schema), {"$ref": f"#/$defs/{SHARED_VALUE}"}]}


def _hoist_distributions(part: Any, definitions: dict[str, Any]) -> Any:
    """Move the distributions in a part of a schema to the definitions."""
    if isinstance(part, list):
        return [_hoist_distributions(item, definitions) for item in part]
    if not isinstance(part, dict):
        return part
    title = part.get("title")
    if isinstance(title, str) and title.startswith(DISTRIBUTION_TITLE):
        name = title.replace(" ", "_")
        definitions[name] = part
        return {"$ref": f"#/$defs/{name}"}
    return {key: _hoist_distributions(value, definitions) for key, value in part.items()}


@dataclass(frozen=True)
class FieldSchema:
    """JSON Schema of the values of a field.

    Attributes:
        schema: Never a reference.
        definitions: Schemas that its parts may refer to, by name.
    """

    schema: Mapping[str, Any]
    definitions: Mapping[str, Any]

    @staticmethod
    def of(model: type[BaseModel]) -> FieldSchema:
        """Schema of a model itself."""
        schema = model_schema(model)
        return FieldSchema({}, schema.get("$defs", {})).part(schema)

    def part(self, schema: Mapping[str, Any]) -> FieldSchema:
        """A part of this schema, or of its definitions if it is a reference."""
        if "$ref" in schema:
            name = schema["$ref"].removeprefix("#/$defs/")
            schema = {**self.definitions[name], **{k: schema[k] for k in schema.keys() - {"$ref"}}}
        return FieldSchema(schema, self.definitions)

    @property
    def branches(self) -> tuple[FieldSchema, ...]:
        """Alternatives of a union other than nothing; empty for any other type."""
        listed = self.schema.get("anyOf") or self.schema.get("oneOf") or ()
        return tuple(self.part(s) for s in listed if s.get("type") != "null")

    @property
    def is_distribution(self) -> bool:
        """Whether the values are distributions other than constants."""
        return str(self.schema.get("title", "")).startswith(DISTRIBUTION_TITLE)

    @property
    def fields(self) -> Mapping[str, Any]:
        """Schemas of a model's fields; empty for any other type."""
        found: Mapping[str, Any] = self.schema.get("properties", {})
        return found

    @property
    def choices(self) -> list[Any]:
        """Values of a closed set; empty for any other type."""
        return [self.schema["const"]] if "const" in self.schema else self.schema.get("enum", [])

    @property
    def tags(self) -> dict[str, Any]:
        """Values of the constant fields of a model, one of which may be its discriminator."""
        return {name: field["const"] for name, field in self.fields.items() if "const" in field}

    @property
    def limits(self) -> Bounds | None:
        """Limits on a number; None if there are none."""
        low, high = self.schema.get("minimum"), self.schema.get("maximum")
        above, below = self.schema.get("exclusiveMinimum"), self.schema.get("exclusiveMaximum")
        if low is high is above is below is None:
            return None
        return Bounds(
            next((v for v in (above, low) if v is not None), -math.inf),
            next((v for v in (below, high) if v is not None), math.inf),
            open_low=above is not None,
            open_high=below is not None,
        )

    def without_nothing(self) -> FieldSchema:
        """``X`` for ``X | None``."""
        branches = self.branches
        return branches[0].without_nothing() if len(branches) == 1 else self

    def child(self, part: str | int) -> FieldSchema:
        """Schema of a field of a model, or of an item of a collection; any value if unknown."""
        schema = self.schema
        listed = schema.get("prefixItems", ())
        if isinstance(part, int) and part < len(listed):
            return self.part(listed[part])
        found = schema.get("items") if isinstance(part, int) else self.fields.get(part)
        found = schema.get("additionalProperties") if found is None else found
        return self.part(found if isinstance(found, Mapping) else {})

    def label_score(self, label: str) -> int:
        """How well pydantic's label of an alternative fits: 0 (not at all) to 3."""
        names = (self.schema.get("title"), *_PYTHON_NAMES.get(self.schema.get("type", ""), ()))
        if label in (*names, *map(str, self.tags.values())):
            return 3
        if label.startswith(tuple(f"{name}[" for name in names)):
            return 3
        if label.startswith("function-plain") and self.is_distribution:
            return 2
        return int(label.endswith(tuple(end for n in names for end in (f"-{n}", f"{n}]"))))

    def words(self) -> str:
        """Description of the values: ``a number in [0, 1]``, ``a list of texts``."""
        suffix = f" {self.limits.within()}" if self.limits else ""
        if self.choices:
            return _alternatives([to_flow_yaml(value) for value in self.choices])
        if self.branches:
            return self._union_words()
        if self.schema.get("type") == "array":
            return self._list_words()
        if self.fields:
            return f"a mapping ({', '.join(self.fields)})"
        if self.schema.get("additionalProperties"):
            return f"a mapping of names to {_plural(self.child('').words())}"
        return f"{_WORDS.get(self.schema.get('type', ''), 'a value')}{suffix}"

    def _union_words(self) -> str:
        listed = self.schema.get("anyOf") or self.schema["oneOf"]
        if any(branch.is_distribution for branch in self.branches):
            constant, _, *others = (self.part(schema) for schema in listed)
            suffix = f" {constant.limits.within()}" if constant.limits else ""
            words = [f"{constant.schema['description']}{suffix}", "a distribution"]
            return " or ".join((*words, *(other.words() for other in others)))
        for name in self.branches[0].tags:
            values = [branch.tags.get(name) for branch in self.branches]
            if None not in values and len(set(values)) == len(listed) > 1:
                return f"a mapping with {name}: {_alternatives([to_flow_yaml(v) for v in values])}"
        return _alternatives([self.part(schema).words() for schema in listed])

    def _list_words(self) -> str:
        if "prefixItems" not in self.schema:
            return f"a list of {_plural(self.child(0).words())}"
        count = len(self.schema["prefixItems"])
        kinds = {self.child(k).words() for k in range(count)}
        return f"a list of {count} {_plural(kinds.pop()) if len(kinds) == 1 else 'values'}"


def _alternatives(words: list[str]) -> str:
    unique = list(dict.fromkeys(words))
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


def _plural(words: str) -> str:
    """``numbers`` for ``a number``; phrases without a simple plural are returned unchanged."""
    for noun in ("whole number", "number", "text", "mapping", "list", "name"):
        if words.startswith(f"a {noun}"):
            return f"{noun}s{words[len(noun) + 2 :]}"
    return words
