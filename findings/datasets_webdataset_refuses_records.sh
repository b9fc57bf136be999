#!/usr/bin/env bash
# Common guess: a .npy member of a WebDataset shard that webdataset decodes is decoded by Hugging Face's
#   load_dataset("webdataset") too.
# What happens: datasets decodes the array and hands it to Arrow. A matrix becomes nested lists; an array
#   of records (a structured dtype, as laser scans have) raises ArrowNotImplementedError, and with it
#   the whole data set cannot be loaded, although nobody asked for that member.
# Why it matters: point clouds with named fields are natural as records. Matrices, with the names of
#   their columns elsewhere, load in both.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q datasets==5.2.0 webdataset==1.0.2 numpy
cd "$work"
HF_HOME="$work/hf" "$work/venv/bin/python" - <<'PY'
import io
import tarfile
from importlib.metadata import version

import numpy as np
import webdataset
from datasets import load_dataset

print(", ".join(f"{name} {version(name)}" for name in ("datasets", "webdataset", "pyarrow", "numpy")))
records = np.zeros(3, [("position", "<f4", (3,)), ("ring", "<u2")])
matrix = np.zeros((3, 4), np.float32)
results = {}
for name, array in (("matrix", matrix), ("records", records)):
    file = io.BytesIO()
    np.save(file, array)
    with tarfile.open(f"{name}.tar", "w") as tar:
        member = tarfile.TarInfo("000000.points.npy")
        member.size = file.getbuffer().nbytes
        file.seek(0)
        tar.addfile(member, file)
    (sample,) = webdataset.WebDataset(f"{name}.tar", shardshuffle=False, empty_check=False).decode()
    assert sample["points.npy"].dtype == array.dtype
    try:
        loaded = load_dataset("webdataset", data_files=f"{name}.tar", split="train")
        results[name] = str(np.array(loaded[0]["points.npy"]).shape)
    except Exception as error:
        cause = error
        while cause.__cause__ is not None:
            cause = cause.__cause__
        results[name] = type(cause).__name__
    print(f"{name}: webdataset reads {array.dtype}; datasets: {results[name]}")
expected = {"matrix": "(3, 4)", "records": "ArrowNotImplementedError"}
assert results == expected, f"behaviour changed: expected {expected}, found {results}"
PY
echo "as described"
