"""HDF5 containers in BlenderProc's layout, read by h5py."""

import json
from pathlib import Path

import numpy as np

from gen_data.lab.certificate.labelled_images import LabelledImage, LabelledObject, Loaded
from gen_data.runner.stored import StoredSamples


def load_hdf5(root: Path, stored: StoredSamples) -> Loaded:
    """Read all arrays of every image; boxes enclose the pixels of each listed instance.

    Counts files only if cameras write no image of instances.
    """
    import h5py

    del stored
    names = {int(k): v for k, v in json.loads((root / "categories.json").read_bytes()).items()}
    images = []
    paths = sorted(root.glob("*/*.hdf5"))
    for path in paths:
        with h5py.File(path) as file:
            arrays = {key: file[key][()] for key in file}
        if "colors" not in arrays or "instance_segmaps" not in arrays:
            continue
        ids = arrays["instance_segmaps"]
        objects = []
        for row in json.loads(arrays["instance_attribute_maps"])[1:]:
            y, x = np.nonzero(ids == row["idx"])
            if len(x):
                box = (int(x.min()), int(y.min()), int(x.max()) + 1, int(y.max()) + 1)
                objects.append(LabelledObject(names[row["category_id"]], box))
        index, _, camera = path.stem.partition("_")
        height, width = ids.shape
        images.append(
            LabelledImage(int(index), camera, path.parent.name, (width, height), tuple(objects))
        )
    return Loaded(images or None, {"files": len(paths)})
