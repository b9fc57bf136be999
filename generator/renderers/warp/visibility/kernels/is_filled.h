#include "scene/kernels/simd.h"

for (int y = box.y_first; y <= box.y_last; ++y)
    for (int x = box.x_first; x <= box.x_last; x += LANES) {
        const auto* pixels = mask.data + outline.first_pixel + y * outline.stride + x;
        if (bits(load(pixels, Bytes()) == Bytes(0)) & first_bits(box.x_last - x + 1))
            return false;
    }
return true;
