"""Feed a training loop from several processes: ``python examples/train_loader.py``.

The first loader reads a finished data set, the second one renders while training; both give the
same batches. With PyTorch, ``gen_data.torch.loader`` gives them as tensors.
"""

import tempfile

import gen_data
from gen_data.targets import detection_target

SAMPLES, BATCH, EPOCHS = 8, 4, 2
SMALL = ["sensors.color.size_px=[160,120]", "splits={train: 1, val: 0, test: 0}"]


def main() -> None:
    """Iterate over both sources."""
    with tempfile.TemporaryDirectory() as folder:
        gen_data.generate("tabletop.yaml", SAMPLES, out=f"{folder}/set", overrides=SMALL, workers=2)
        for name, data in (
            ("finished", gen_data.open(f"{folder}/set")),
            ("rendered", gen_data.Dataset("tabletop.yaml", n=SAMPLES, overrides=SMALL)),
        ):
            loader = gen_data.Loader(
                data, detection_target, batch_size=BATCH, shuffle=True, workers=2
            )
            for epoch in range(EPOCHS):
                for batch in loader:
                    numbers = [int(target["image_id"]) for _, target in batch]
                    boxes = sum(len(target["boxes"]) for _, target in batch)
                    print(f"{name}, epoch {epoch}: images {numbers}, {boxes} boxes")


if __name__ == "__main__":
    main()
