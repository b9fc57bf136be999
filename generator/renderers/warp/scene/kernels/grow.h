// Trees are built on the CPU, for all devices.
#if !defined(__CUDA_ARCH__)
#pragma push_macro("AS_ON_GPU")
#undef AS_ON_GPU
#include "scene/kernels/simd.h"

// Wald 2007: with 16 bins, trees are nearly as good as those of a full sweep.
constexpr int BINS = 16;
// Deeper nodes are split at the median. With it, the stack suffices for 2^24 boxes: eight
// levels of arbitrary splits and eight of halves, each pushing seven more than it pops.
constexpr int EVEN_DEPTH = 8, WAITING_MAX = 128;
constexpr float FARTHEST = 3.0e38f;

// A box: its low corner, its number, minus its high corner, 0. Its union with another is one
// minimum. Boxes are moved, so that those of a part are contiguous.
auto box_at = [&](int i) { return load(boxes.data + 8 * i, Floats()); };
auto set_box = [&](int i, Floats box) { put(boxes.data + 8 * i, ~0u, box); };
auto half_area = [](Floats box) {
    const float x = -box[4] - box[0], y = -box[5] - box[1], z = -box[6] - box[2];
    return x * y + y * z + z * x;
};
// Twice the centre: only the order matters, and halving would add a rounding for nothing.
auto doubled_centre = [](Floats box) -> Floats {
    return box - __builtin_shufflevector(box, box, 4, 5, 6, 7, 0, 1, 2, 3);
};
auto bin_of = [](float steps) {
    const int k = (int)steps;
    return k < 0 ? 0 : k >= BINS ? BINS - 1 : k;
};

// Boxes in the order of their cells are cut between cells.
const bool is_sorted = cells.shape[0] > 0;

// Part of a node: its bounds, and those of its boxes' doubled centres, unless boxes are sorted.
struct Part { int begin, end; Floats bounds, low, high; };
auto add = [&](Part& part, Floats box) {
    part.bounds = smaller(part.bounds, box);
    if (is_sorted)
        return;
    const Floats centre = doubled_centre(box);
    part.low = smaller(part.low, centre);
    part.high = larger(part.high, centre);
};
auto part_of = [&](int begin, int end) {
    Part part = {begin, end, FARTHEST, FARTHEST, -FARTHEST};
    for (int i = begin; i < end; ++i)
        add(part, box_at(i));
    return part;
};

auto halve = [&](const Part& part, Part& left, Part& right) {
    const int middle = (part.begin + part.end) / 2;
    left = part_of(part.begin, middle);
    right = part_of(middle, part.end);
};
// The axis and the bin at which the best split begins its right part; no axis if all centres coincide.
struct Split { int axis, at; };
auto best_split = [&](const Part& part, Floats scale) -> Split {
    const Floats low = part.low, high = part.high;
    Floats bins[3][BINS];
    int counts[3][BINS] = {};
    for (auto& of_axis : bins)
        for (auto& bin : of_axis)
            bin = FARTHEST;
    for (int i = part.begin; i < part.end; ++i) {
        const Floats box = box_at(i), steps = (doubled_centre(box) - low) * scale;
        for (int axis = 0; axis < 3; ++axis) {
            const int k = bin_of(steps[axis]);
            bins[axis][k] = smaller(bins[axis][k], box);
            ++counts[axis][k];
        }
    }
    // Surface area heuristic; leaves are intersected eight faces at once, so leaves count, not
    // faces.
    auto cost_of = [&](Floats bounds, int count) {
        return half_area(bounds) * (float)((count + leaf - 1) / leaf);
    };
    float best = FARTHEST;
    Split split = {-1, 0};
    for (int axis = 0; axis < 3; ++axis) {
        if (!(high[axis] > low[axis]))
            continue;
        // Costs to the right of each plane, then those to its left.
        float beyond[BINS];
        Floats bounds = FARTHEST;
        int count = 0;
        for (int k = BINS - 1; k > 0; --k) {
            bounds = smaller(bounds, bins[axis][k]);
            count += counts[axis][k];
            beyond[k] = count > 0 ? cost_of(bounds, count) : FARTHEST;
        }
        bounds = FARTHEST;
        count = 0;
        for (int k = 1; k < BINS; ++k) {
            bounds = smaller(bounds, bins[axis][k - 1]);
            count += counts[axis][k - 1];
            if (count == 0 || beyond[k] >= FARTHEST)
                continue;
            const float cost = beyond[k] + cost_of(bounds, count);
            if (cost < best) {
                best = cost;
                split = {axis, k};
            }
        }
    }
    return split;
};
// Cut a sorted part where the highest bit changes in which its cells differ.
auto cut_sorted = [&](const Part& part, Part& left, Part& right) {
    const unsigned first = cells.data[part.begin], last = cells.data[part.end - 1];
    if (first == last)
        return halve(part, left, right);
    const unsigned changed = 1u << (31 - __builtin_clz(first ^ last));
    const unsigned least = last & ~(changed - 1);
    int below = part.begin, from = part.end - 1;
    while (from - below > 1) {
        const int middle = (below + from) / 2;
        (cells.data[middle] < least ? below : from) = middle;
    }
    left = part_of(part.begin, from);
    right = part_of(from, part.end);
};
// Cut a part in two.
auto cut = [&](const Part& part, Part& left, Part& right) {
    if (is_sorted)
        return cut_sorted(part, left, right);
    const int begin = part.begin, end = part.end;
    const Floats low = part.low, high = part.high;
    Floats scale = 0.0f;
    for (int axis = 0; axis < 3; ++axis)
        if (high[axis] > low[axis])
            scale[axis] = (float)BINS / (high[axis] - low[axis]);
    const Split split = best_split(part, scale);
    left = {begin, begin, FARTHEST, FARTHEST, -FARTHEST};
    right = {end, end, FARTHEST, FARTHEST, -FARTHEST};
    // All centres coincide: any split is as good, and the median keeps the depth logarithmic.
    if (split.axis < 0)
        return halve(part, left, right);
    // In place, as in quicksort.
    while (left.end < right.begin) {
        const Floats box = box_at(left.end);
        const float centre = doubled_centre(box)[split.axis];
        if (bin_of((centre - low[split.axis]) * scale[split.axis]) < split.at) {
            add(left, box);
            ++left.end;
        } else {
            add(right, box);
            set_box(left.end, box_at(--right.begin));
            set_box(right.begin, box);
        }
    }
};

struct Task { int begin, end, depth, lane; };
Task waiting[WAITING_MAX];
waiting[0] = {0, (int)boxes.shape[0], 0, -1};
int waiting_count = 1, node_count = 0, leaf_count = 0;
while (waiting_count > 0) {
    const Task task = waiting[--waiting_count];
    int code = node_count;
    if (task.end - task.begin <= leaf) {
        leaves.data[leaf_count] = wp::vec2i(task.begin, task.end);
        code = -++leaf_count;
    } else {
        Part parts[8];
        parts[0] = part_of(task.begin, task.end);
        int count = 1, chosen = 0;
        while (chosen >= 0) {
            Part left, right;
            if (task.depth < EVEN_DEPTH)
                cut(parts[chosen], left, right);
            else
                halve(parts[chosen], left, right);
            // Parts stay in order.
            for (int k = count++; k > chosen + 1; --k)
                parts[k] = parts[k - 1];
            parts[chosen] = left;
            parts[chosen + 1] = right;
            // Continue with the largest part, in deep nodes that of most boxes, until the node
            // is full.
            chosen = -1;
            float most = -1.0f;
            for (int k = 0; count < 8 && k < count; ++k) {
                const int size = parts[k].end - parts[k].begin;
                const float priority = size <= leaf              ? -1.0f
                                       : task.depth < EVEN_DEPTH ? half_area(parts[k].bounds)
                                                                 : (float)size;
                if (priority > most) {
                    most = priority;
                    chosen = k;
                }
            }
        }
        float* node = nodes.data + 48 * node_count;
        for (int k = 0; k < 8; ++k) {
            const bool used = k < count;
            if (used)
                waiting[waiting_count++] = {parts[k].begin, parts[k].end, task.depth + 1,
                                            8 * node_count + k};
            for (int axis = 0; axis < 3; ++axis) {
                node[16 * axis + k] = used ? parts[k].bounds[axis] : NOWHERE;
                node[16 * axis + 8 + k] = used ? -parts[k].bounds[4 + axis] : -NOWHERE;
            }
        }
        ++node_count;
    }
    // A node's number is known only now: write it into its parent's lane.
    if (task.lane >= 0)
        codes.data[task.lane] = code;
}
counts.data[0] = node_count;
counts.data[1] = leaf_count;
#pragma pop_macro("AS_ON_GPU")
#endif
