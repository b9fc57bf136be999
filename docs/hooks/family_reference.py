"""Reference page of families of assets: parameters of their ids, with ranges and options."""

from collections.abc import Iterator

from docs.hooks.plugin_reference import as_fields
from gen_data.assets.asset_ids import format_parameter
from gen_data.assets.families import family_summary, own_families
from gen_data.assets.family import Family
from gen_data.assets.library import Library, open_library

VARIANTS = 4
"""Variants made per family: further ones barely change ranges, and all would take minutes."""


def family_page() -> str:
    """The page of all families of objects."""
    library = open_library()
    lines = [
        "# Families of assets",
        "An asset id may set any parameter of its family: `desk?seed=3&width_m=1.6`"
        " ([assets](../assets.md#sizes-and-choices)). Ranges are taken over the first"
        f" {VARIANTS} variants; a variant whose other draws leave less room refuses more, and"
        " `gen-data describe FAMILY` prints the same texts.",
    ]
    for name, family in own_families().items():
        if isinstance(family, Family):
            lines += [f"## {name}", *family_section(name, family, library)]
    return "\n\n".join(lines) + "\n"


def family_section(name: str, family: Family, library: Library) -> Iterator[str]:
    """Summary of a family, and a table of its parameters."""
    count = f" {family.variants} variants." if family.variants else ""
    yield f"{family_summary(family)}{count}".replace("<", "&lt;")
    rows = [
        f"| `{key}` | default {format_parameter(value)} |"  # type: ignore[arg-type]
        for key, value in family.parameters.items()
    ]
    for one in library.parameters(name, VARIANTS) if family.variants else ():
        some = "" if one.is_common else "; some variants"
        rows.append(f"| `{one.name}` | {one.words()}{some} |")
    if rows:
        yield as_fields("\n".join(("| parameter | values |", "|---|---|", *rows)))
