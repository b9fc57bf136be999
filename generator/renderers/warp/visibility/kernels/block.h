// The nine pixels of ``neighbour_pixel``, in its order, as ``block``. Needs ``view``, ``x``, ``y``.

const int left = x > 0 ? x - 1 : 0, right = x + 1 < view.width ? x + 1 : x;
const int row = y * view.width, up = y > 0 ? row - view.width : row;
const int down = y + 1 < view.height ? row + view.width : row;
const int block[9] = {row + x, up + x, row + left, row + right, down + x,
                      up + left, up + right, down + left, down + right};
