#include "visibility/kernels/block.h"

int first = -1, others = 0;
for (int k = 0; k < 9; ++k) {
    const auto& shown = images.hits.data[block[k]];
    if (shown[0] != hit[0])
        continue;
    if (shown[1] == hit[1])
        return wp::vec2i(block[k], 0);
    if (others++ == 0)
        first = block[k];
}
return wp::vec2i(first, others);
