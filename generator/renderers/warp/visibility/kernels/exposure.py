"""Mean of an image over the time slices of its exposure."""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.kernel
def add_rows(
    width: int,
    begin: int,
    first: int,
    weights: wp.array[float],
    part: wp.array[wp.vec3],
    mean: wp.array[wp.vec3],
):
    """Add rows of a slice, by their share of each row's exposure, to the mean.

    Args:
        width: Pixels in a row.
        begin: Row of ``part`` at which they begin.
        first: Row of the image at which they begin.
    """
    row, column = wp.tid()
    i = (first + row) * width + column
    mean[i] = mean[i] + part[(begin + row) * width + column] * weights[row]
