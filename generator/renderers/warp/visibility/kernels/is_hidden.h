#include "scene/kernels/simd.h"

for (int y = box.y_first; y <= box.y_last; ++y)
    for (int x = box.x_first; x <= box.x_last; x += LANES) {
        const Floats nearest = load(nearness.data + y * stride + x, Floats());
        if (bits(nearest < Floats(nearness_max)) & first_bits(box.x_last - x + 1))
            return false;
    }
return true;
