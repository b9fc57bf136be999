// Out of line: most modules traverse trees in several places.
auto walked = [&]() __attribute__((noinline)) {
constexpr bool ANY = false;
#include "scene/kernels/ray_traversal.h"
#include "scene/kernels/in_scene.h"
#include "scene/kernels/found.h"
};
return walked();
