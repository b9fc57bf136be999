"""Numbers that steer paths: scrambled Sobol points, each a function of pixel, sample and dimension.

Nothing is kept between paths, so that images do not depend on the order of pixels. All paths of an
image share one sequence, along a curve through the pixels that never leaves a square before it has
filled it: not only the samples of a pixel but those of neighbours together are even, so that noise
is fine-grained and the eye averages it away. Pairs of dimensions are padded: each is a
(0, 2)-sequence of its own, shuffled against the others.

Sources: Sobol, "On the distribution of points in a cube", 1967 (the second dimension's matrix is
Pascal's triangle modulo 2); Owen, "Randomly permuted (t,m,s)-nets and (t,s)-sequences", 1995;
Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020; Vegdahl, "Building a better LK
hash", 2021 (constants of ``scrambled``); Ahmed and Wonka, "Screen-space blue-noise diffusion of
Monte Carlo sampling error via hierarchical ordering of pixels", SIGGRAPH Asia 2020; Jarzynski and
Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020 (pcg).
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.func
def hash_bits(key: wp.uint32):
    """A hash of 32 bits."""
    x = key * wp.uint32(747796405) + wp.uint32(1442695041)
    x = ((x >> ((x >> wp.uint32(28)) + wp.uint32(4))) ^ x) * wp.uint32(277803737)
    return (x >> wp.uint32(22)) ^ x


@wp.func
def swap_bits(bits: wp.uint32, width: wp.uint32, mask: wp.uint32):
    """Neighbouring groups of that many bits in each other's place; the mask is of every second."""
    return ((bits & mask) << width) | ((bits >> width) & mask)


@wp.func
def reverse_bits(bits: wp.uint32):
    """The same bits, the last first."""
    x = (bits << wp.uint32(16)) | (bits >> wp.uint32(16))
    x = swap_bits(x, wp.uint32(8), wp.uint32(0x00FF00FF))
    x = swap_bits(x, wp.uint32(4), wp.uint32(0x0F0F0F0F))
    x = swap_bits(x, wp.uint32(2), wp.uint32(0x33333333))
    return swap_bits(x, wp.uint32(1), wp.uint32(0x55555555))


@wp.func
def scramble(bits: wp.uint32, seed: wp.uint32):
    """Flip each bit by a hash of the bits below it."""
    x = bits ^ (bits * wp.uint32(0x3D20ADEA))
    x = (x + seed) * ((seed >> wp.uint32(16)) | wp.uint32(1))
    x = x ^ (x * wp.uint32(0x05526C56))
    return x ^ (x * wp.uint32(0x53A22864))


@wp.func
def second_dimension(index: wp.uint32):
    """Bits of an index times Pascal's triangle modulo 2: the second Sobol dimension, reversed."""
    x = index
    x = x ^ ((x >> wp.uint32(1)) & wp.uint32(0x55555555))
    x = x ^ ((x >> wp.uint32(2)) & wp.uint32(0x33333333))
    x = x ^ ((x >> wp.uint32(4)) & wp.uint32(0x0F0F0F0F))
    x = x ^ ((x >> wp.uint32(8)) & wp.uint32(0x00FF00FF))
    return x ^ ((x >> wp.uint32(16)) & wp.uint32(0x0000FFFF))


@wp.func
def unit_float(bits: wp.uint32):
    """Bits as a number in [0, 1)."""
    return float(bits >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def spread_bits(bits: wp.uint32):
    """The lower sixteen bits, a zero between any two."""
    x = bits & wp.uint32(0x0000FFFF)
    x = (x | (x << wp.uint32(8))) & wp.uint32(0x00FF00FF)
    x = (x | (x << wp.uint32(4))) & wp.uint32(0x0F0F0F0F)
    x = (x | (x << wp.uint32(2))) & wp.uint32(0x33333333)
    return (x | (x << wp.uint32(1))) & wp.uint32(0x55555555)


@wp.func
def morton_index(x: int, y: int):
    """Number of a pixel along Morton's curve."""
    return spread_bits(wp.uint32(x)) | (spread_bits(wp.uint32(y)) << wp.uint32(1))


@wp.func
def random_pair(key: wp.uint32, dimension: int, sample: wp.uint32):
    """Two numbers in [0, 1).

    Args:
        key: Of the image.
        dimension: Any number that tells this pair from the others of one path.
        sample: Number in the image's sequence. Each aligned power of two of them is stratified as
            a (0, m, 2)-net.
    """
    seed = hash_bits(key ^ (wp.uint32(dimension) * wp.uint32(0x5851F42D)))
    # Each pair of one path goes through the samples in an order of its own.
    index = reverse_bits(scramble(reverse_bits(sample), seed))
    # Arbitrary odd numbers: they only have to differ, so that no two streams are alike.
    first = scramble(index, hash_bits(seed ^ wp.uint32(0x2511E9B3)))
    second = scramble(second_dimension(index), hash_bits(seed ^ wp.uint32(0x63D83595)))
    return wp.vec2(unit_float(reverse_bits(first)), unit_float(reverse_bits(second)))


@wp.func
def random_number(key: wp.uint32, dimension: int, sample: wp.uint32):
    """A number in [0, 1) that has nothing to do with any other."""
    seed = hash_bits(key ^ (wp.uint32(dimension) * wp.uint32(0x2C1B3C6D)))
    return unit_float(hash_bits(seed + sample))
