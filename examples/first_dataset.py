"""Generate one sample and draw its boxes: ``python examples/first_dataset.py``."""

import cv2

import gen_data

OUTPUT = "first_dataset.png"
FAST = ["sensors.color.size_px=[320,240]"]


def main() -> None:
    """Print the boxes of a sample and write its image with them."""
    with gen_data.Dataset("tabletop.yaml", seed=7, overrides=FAST) as data:
        camera = data[0].cameras["color"]
    picture = camera.rgb[..., ::-1].copy()  # OpenCV stores blue, green, red
    for box in camera.boxes2d:
        print(f"{box.category:16} {box.xyxy} visible: {box.visible_fraction:.2f}")
        # Boxes are half-open: the last pixel inside is x_max - 1.
        corners = (box.x_min, box.y_min), (box.x_max - 1, box.y_max - 1)
        cv2.rectangle(picture, *corners, (0, 200, 255))
        cv2.putText(picture, box.category, corners[0], cv2.FONT_HERSHEY_PLAIN, 0.8, (0, 200, 255))
    cv2.imwrite(OUTPUT, picture)
    print(f"wrote {OUTPUT}")


if __name__ == "__main__":
    main()
