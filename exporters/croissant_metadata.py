"""Parts of Croissant 1.0 metadata: head of the document, files, and record sets.

Reference: https://docs.mlcommons.org/croissant/docs/croissant-spec.html.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import yaml

from gen_data.core.interfaces import DatasetInfo

CONFORMS_TO = "http://mlcommons.org/croissant/1.0"


def croissant_document(
    info: DatasetInfo,
    licences: Sequence[str],
    distribution: Sequence[Mapping[str, Any]],
    record_sets: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Content of ``croissant.json``.

    Args:
        info: The data set, with its title, licence and creators.
        licences: Licences of its assets, which are stated if it has none.
        distribution: See ``file_object`` and ``file_set``.
        record_sets: See ``record_set``.
    """
    facts = info.publication
    stated = [facts.license] if facts.license else list(licences)
    optional = {
        "license": stated[0] if len(stated) == 1 else stated,
        "url": facts.url,
        "creator": [{"@type": "sc:Person", "name": name} for name in facts.creators],
        "datePublished": facts.date_published,
        "citeAs": facts.cite_as,
    }
    return {
        "@context": _read_context(),
        "@type": "sc:Dataset",
        "name": title_of(info),
        "description": describe_dataset(info),
        "conformsTo": CONFORMS_TO,
        "version": facts.version,
        **{key: value for key, value in optional.items() if value},
        "distribution": list(distribution),
        "recordSet": list(record_sets),
    }


def title_of(info: DatasetInfo) -> str:
    """Title of a data set, or the name of its configuration."""
    return info.publication.title or info.name


def describe_dataset(info: DatasetInfo) -> str:
    """The publisher's description, or one sentence on the origin of the data."""
    return info.publication.description or (
        f"Synthetic images with exact labels, rendered by gen-data from the configuration "
        f"'{info.name}' with seed {info.seed}."
    )


def file_object(path: str, size_bytes: int, sha256: str, encoding: str) -> dict[str, Any]:
    """Describe one file; ``path`` is relative to the metadata."""
    return {
        "@type": "cr:FileObject",
        "@id": path,
        "name": path,
        "contentUrl": path,
        "contentSize": f"{size_bytes} B",
        "encodingFormat": encoding,
        "sha256": sha256,
    }


def file_set(name: str, description: str, encoding: str, includes: str) -> dict[str, Any]:
    """Describe all files whose path, relative to the metadata, matches the pattern ``includes``."""
    return {
        "@type": "cr:FileSet",
        "@id": name,
        "name": name,
        "description": description,
        "encodingFormat": encoding,
        "includes": includes,
    }


def record_set(
    name: str, description: str, fields: Mapping[str, tuple[str, Mapping[str, Any]]]
) -> dict[str, Any]:
    """Describe records by ``{field: (data type, source)}``; the first field is the key."""
    return {
        "@type": "cr:RecordSet",
        "@id": name,
        "name": name,
        "description": description,
        "key": {"@id": f"{name}/{next(iter(fields))}"},
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"{name}/{field}",
                "name": f"{name}/{field}",
                "dataType": kind,
                "source": dict(source),
            }
            for field, (kind, source) in fields.items()
        ],
    }


def extract(
    files_id: str, how: Mapping[str, str], *transforms: Mapping[str, str], is_set: bool = True
) -> dict[str, Any]:
    """Source of a field: files, the extracted part of each, and transforms of its value."""
    source: dict[str, Any] = {
        "fileSet" if is_set else "fileObject": {"@id": files_id},
        "extract": dict(how),
    }
    return {**source, "transform": [dict(t) for t in transforms]} if transforms else source


@cache
def _read_context() -> Mapping[str, Any]:
    """Read the terms of Croissant, the JSON-LD context."""
    text = (files("gen_data.exporters") / "croissant_context.yaml").read_text("utf-8")
    context: dict[str, Any] = yaml.safe_load(text)
    return context
