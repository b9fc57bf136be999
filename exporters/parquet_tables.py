"""Parquet tables as the library ``datasets`` reads them, with the same bytes on every machine.

``datasets`` finds the features of the columns under the key ``huggingface`` of the schema: images,
names of classes and lengths of lists, which Parquet's own types do not state. Bytes depend on the
release of pyarrow, which writes its name into each file.

Reference: https://huggingface.co/docs/datasets/about_dataset_features.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyarrow
    from pyarrow.parquet import ParquetWriter

GROUP_ROWS = 100
"""Rows of a row group, at most: viewers load whole groups."""

IMAGE = {"_type": "Image"}
"""Feature of a column of images: bytes of a file, and its name."""


def value_feature(dtype: str) -> dict[str, Any]:
    """Feature of numbers, texts or bytes of an Arrow type."""
    return {"dtype": dtype, "_type": "Value"}


def list_feature(feature: Mapping[str, Any], length: int = -1) -> dict[str, Any]:
    """Feature of a list; older releases of ``datasets`` know this name of it only."""
    return {"feature": feature, "length": length, "_type": "Sequence"}


def array_feature(dtype: str, shape: Sequence[int]) -> dict[str, Any]:
    """Feature of an array of one or two dimensions."""
    if len(shape) == 1:
        value = value_feature(dtype)
        return value if shape[0] == 1 else list_feature(value, shape[0])
    return {"shape": [*shape], "dtype": dtype, "_type": f"Array{len(shape)}D"}


def array_column(values: "np.ndarray[Any, Any]") -> "pyarrow.Array":
    """Column of an ``array_feature`` from the arrays of all rows, [n, ...]."""
    import pyarrow

    column = pyarrow.array(values.ravel())
    if values.ndim == 2 and values.shape[1] > 1:
        return pyarrow.FixedSizeListArray.from_arrays(column, values.shape[1])
    for size in reversed(values.shape[1:] if values.ndim > 2 else ()):
        column = pyarrow.ListArray.from_arrays(
            np.arange(0, len(column) + 1, size, dtype=np.int32), column
        )
    return column


def table_schema(features: Mapping[str, Any]) -> "pyarrow.Schema":
    """Parquet schema of features, which are also in its metadata."""
    import pyarrow

    columns = [(name, _arrow_type(feature)) for name, feature in features.items()]
    described = json.dumps({"info": {"features": features}})
    return pyarrow.schema(columns, metadata={"huggingface": described})


def _arrow_type(feature: Mapping[str, Any]) -> "pyarrow.DataType":
    import pyarrow

    match feature.get("_type"):
        case "Image":
            return pyarrow.struct({"bytes": pyarrow.binary(), "path": pyarrow.string()})
        case "ClassLabel":
            return pyarrow.int64()
        case "Sequence":
            # A list_ of length -1 has any length.
            return pyarrow.list_(_arrow_type(feature["feature"]), feature["length"])
        case "Array2D":
            return pyarrow.list_(pyarrow.list_(pyarrow.type_for_alias(feature["dtype"])))
        case "Value":
            return pyarrow.type_for_alias(feature["dtype"])
    return pyarrow.struct({name: _arrow_type(inner) for name, inner in feature.items()})


def open_parquet(path: Path, schema: "pyarrow.Schema") -> "ParquetWriter":
    """Open a Parquet file for writing; creates its folder."""
    from pyarrow.parquet import ParquetWriter

    path.parent.mkdir(parents=True, exist_ok=True)
    # Image files do not shrink, and few values repeat: compression and dictionaries do not pay.
    return ParquetWriter(
        path,
        schema,
        version="2.6",
        data_page_version="1.0",
        compression="none",
        use_dictionary=False,
        write_statistics=False,
        store_schema=True,
    )
