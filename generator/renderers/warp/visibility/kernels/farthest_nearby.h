#include "scene/kernels/simd.h"
#include "visibility/kernels/block.h"

float farthest = 0.0f;
for (int k = 0; k < 9; ++k)
    farthest = -least(-farthest, -images.z_m.data[block[k]]);
return farthest;
