"""Errors of pydantic, found again in the document and in the types."""

from __future__ import annotations

import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from gen_data.generator.config.distributions.fields import FieldOf
from gen_data.generator.config.problems import FieldPath
from gen_data.generator.config.type_names import is_union, union_branches, unwrap_annotated

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Owner = tuple[Any, tuple[Any, ...]]
"""A type and its metadata."""

_WHOLE_UNION = "whole_union"


@dataclass(frozen=True)
class Fault:
    """One error.

    Attributes:
        kind: Pydantic's name of it; ``fact`` for those that carry our own words.
        detail: Everything pydantic tells.
        path: Of the field, without the names of union branches.
        below: From there to the place of the fault inside a distribution.
        owner: Type of the field; of the mapping or list, for an unknown or missing part.
        at_key: The key is at fault, not its value.
        union: The innermost union on the way, and its path; None if there is none.
        branch: Which alternative of that union pydantic was trying.
    """

    kind: str
    detail: ErrorDetails
    path: FieldPath
    owner: Owner
    below: FieldPath = ()
    at_key: bool = False
    union: tuple[FieldPath, Any] | None = None
    branch: str = ""

    @property
    def depth(self) -> int:
        """How far pydantic came before it failed."""
        return len(self.path) + len(self.below)

    @property
    def context(self) -> dict[str, Any]:
        """What pydantic's message is made of."""
        return self.detail.get("ctx", {})


def locate_error(detail: ErrorDetails, model: type[BaseModel]) -> Fault:
    """Follow an error's ``loc`` down the types, dropping what names union branches."""
    owner: Owner = (model, ())
    path: FieldPath = ()
    union: tuple[FieldPath, Any] | None = None
    branch = ""
    kind, context = detail["type"], detail.get("ctx", {})
    of_holder = kind in {"missing", "extra_forbidden"}
    last = len(detail["loc"]) - of_holder
    for number, part in enumerate(detail["loc"]):
        owner = _without_none(owner)
        if is_union(owner[0]):
            union, branch = (path, owner[0]), str(part)
            owner = unwrap_annotated(_branch(owner[0], branch))
        elif part != "[key]":
            path = (*path, part)
            owner = child_type(owner[0], part) if number < last else owner
    if kind == "missing" and isinstance(path[-1], int):
        path = path[:-1]
    if kind == "union_tag_invalid":
        path = (*path, str(context["discriminator"]).strip("'"))
    return Fault(
        kind,
        detail,
        path,
        _without_none(owner),
        below=tuple(context["path"]) if kind == "fact" else (),
        at_key=kind == "extra_forbidden" or bool(context.get("at_key")),
        union=union,
        branch=branch,
    )


def without_union_noise(faults: list[Fault]) -> Iterator[Fault]:
    """Of the errors of a union's alternatives, those of the one that was probably meant.

    That is the alternative that failed deepest; if all refused the value as a whole, one fault
    stands for them all.
    """
    groups: dict[object, list[Fault]] = {}
    for number, fault in enumerate(faults):
        groups.setdefault(fault.union[0] if fault.union else number, []).append(fault)
    for group in groups.values():
        deepest = max(group, key=lambda fault: fault.depth)
        union = deepest.union
        if union is None or len({fault.branch for fault in group}) == 1:
            yield from group
        elif deepest.depth > len(union[0]):
            yield from (fault for fault in group if fault.branch == deepest.branch)
        else:
            yield Fault(_WHOLE_UNION, deepest.detail, union[0], (union[1], ()))


def child_type(annotation: Any, part: str | int) -> Owner:
    """Type of a field of a model, or of an item of a collection."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        info = annotation.model_fields.get(str(part))
        return (
            (Any, ()) if info is None else unwrap_annotated(info.annotation, tuple(info.metadata))
        )
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is tuple and isinstance(part, int) and Ellipsis not in arguments:
        return unwrap_annotated(arguments[part]) if part < len(arguments) else (Any, ())
    if origin in (list, tuple, set, frozenset):
        return unwrap_annotated(arguments[0])
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return unwrap_annotated(arguments[1])
    return (Any, ())


def literal_tags(annotation: Any) -> list[str]:
    """Values of the literal fields of a model, one of which may be its discriminator."""
    fields = getattr(annotation, "model_fields", {})
    return [
        str(value)
        for info in fields.values()
        if typing.get_origin(info.annotation) is Literal
        for value in typing.get_args(info.annotation)
    ]


def _without_none(owner: Owner) -> Owner:
    """``X`` for ``X | None``: pydantic names no branch for it."""
    annotation, metadata = owner
    if is_union(annotation) and len(union_branches(annotation)) == 1:
        return unwrap_annotated(union_branches(annotation)[0], metadata)
    return owner


def _branch(union: Any, label: str) -> Any:
    """The alternative of a union that a part of ``loc`` names: by its type, or by its tag."""
    candidates = union_branches(union)
    scores = [_likeness(label, *unwrap_annotated(candidate)) for candidate in candidates]
    return candidates[scores.index(max(scores))]


def _likeness(label: str, annotation: Any, metadata: tuple[Any, ...]) -> int:
    """How surely pydantic's label of a union's alternative means a type."""
    name = getattr(annotation, "__name__", str(annotation))
    if label == name or label.startswith(f"{name}[") or label in literal_tags(annotation):
        return 3
    if label.startswith("function-plain") and any(isinstance(m, FieldOf) for m in metadata):
        return 2
    return int(label.endswith((f"-{name}", f"{name}]")))
