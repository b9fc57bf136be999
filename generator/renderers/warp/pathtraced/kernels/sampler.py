"""Samples of paths: scrambled Sobol points, a function of pixel, sample and dimension.

The sampler has no state, so images do not depend on the order of pixels. All paths of an image
share one sequence along a Morton curve through the pixels: the samples of a pixel, and of
neighbouring pixels together, are well distributed: noise has a high frequency and averages out for
the eye. Pairs of dimensions are padded: each is a separate (0, 2)-sequence, shuffled against the
others.

Sources: Sobol, "On the distribution of points in a cube", 1967 (the second dimension's matrix is
Pascal's triangle modulo 2); Owen, "Randomly permuted (t,m,s)-nets and (t,s)-sequences", 1995;
Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020; Vegdahl, "Building a better LK
hash", 2021 (constants of ``scramble``); Ahmed and Wonka, "Screen-space blue-noise diffusion of
Monte Carlo sampling error via hierarchical ordering of pixels", SIGGRAPH Asia 2020; Jarzynski and
Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020 (pcg).
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.func
def hash_bits(key: wp.uint32):
    """A 32-bit hash (pcg)."""
    x = key * wp.uint32(747796405) + wp.uint32(1442695041)
    x = ((x >> ((x >> wp.uint32(28)) + wp.uint32(4))) ^ x) * wp.uint32(277803737)
    return (x >> wp.uint32(22)) ^ x


@wp.func
def swap_bits(bits: wp.uint32, width: wp.uint32, mask: wp.uint32):
    """Swap neighbouring groups of ``width`` bits; the mask selects every second group."""
    return ((bits & mask) << width) | ((bits >> width) & mask)


@wp.func
def reverse_bits(bits: wp.uint32):
    """The bits in reverse order."""
    # Swap halves, then ever smaller groups: five steps instead of 32.
    x = (bits << wp.uint32(16)) | (bits >> wp.uint32(16))
    x = swap_bits(x, wp.uint32(8), wp.uint32(0x00FF00FF))
    x = swap_bits(x, wp.uint32(4), wp.uint32(0x0F0F0F0F))
    x = swap_bits(x, wp.uint32(2), wp.uint32(0x33333333))
    return swap_bits(x, wp.uint32(1), wp.uint32(0x55555555))


@wp.func
def scramble(bits: wp.uint32, seed: wp.uint32):
    """Flip each bit by a hash of the bits below it (a Laine-Karras permutation)."""
    # Additions and multiplications carry upwards only: no bit depends on a higher one. On reversed
    # bits that is Owen's nested scrambling.
    x = bits ^ (bits * wp.uint32(0x3D20ADEA))
    x = (x + seed) * ((seed >> wp.uint32(16)) | wp.uint32(1))
    x = x ^ (x * wp.uint32(0x05526C56))
    return x ^ (x * wp.uint32(0x53A22864))


@wp.func
def second_dimension(index: wp.uint32):
    """The second Sobol dimension of an index, reversed: Pascal's triangle modulo 2."""
    # The triangle factors into five sparse matrices, one per power of two.
    x = index
    x = x ^ ((x >> wp.uint32(1)) & wp.uint32(0x55555555))
    x = x ^ ((x >> wp.uint32(2)) & wp.uint32(0x33333333))
    x = x ^ ((x >> wp.uint32(4)) & wp.uint32(0x0F0F0F0F))
    x = x ^ ((x >> wp.uint32(8)) & wp.uint32(0x00FF00FF))
    return x ^ ((x >> wp.uint32(16)) & wp.uint32(0x0000FFFF))


@wp.func
def unit_float(bits: wp.uint32):
    """The upper 24 bits as a number in [0, 1)."""
    # 24 bits are exact in single precision: 1 is never reached by rounding.
    return float(bits >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def spread_bits(bits: wp.uint32):
    """The lower sixteen bits, interleaved with zeros."""
    x = bits & wp.uint32(0x0000FFFF)
    x = (x | (x << wp.uint32(8))) & wp.uint32(0x00FF00FF)
    x = (x | (x << wp.uint32(4))) & wp.uint32(0x0F0F0F0F)
    x = (x | (x << wp.uint32(2))) & wp.uint32(0x33333333)
    return (x | (x << wp.uint32(1))) & wp.uint32(0x55555555)


@wp.func
def morton_index(x: int, y: int):
    """Number of a pixel along the Morton curve."""
    return spread_bits(wp.uint32(x)) | (spread_bits(wp.uint32(y)) << wp.uint32(1))


@wp.func
def random_pair(key: wp.uint32, dimension: int, sample: wp.uint32):
    """Two numbers in [0, 1).

    Args:
        key: Key of the image.
        dimension: Number that identifies this pair within one path.
        sample: Number in the image's sequence. Each aligned power of two of them is stratified as a
            (0, m, 2)-net.
    """
    seed = hash_bits(key ^ (wp.uint32(dimension) * wp.uint32(0x5851F42D)))
    # Shuffle the sequence: each pair of one path traverses it in a different order.
    index = reverse_bits(scramble(reverse_bits(sample), seed))
    # Arbitrary odd constants: both streams are independent as long as they differ.
    first = scramble(index, hash_bits(seed ^ wp.uint32(0x2511E9B3)))
    second = scramble(second_dimension(index), hash_bits(seed ^ wp.uint32(0x63D83595)))
    return wp.vec2(unit_float(reverse_bits(first)), unit_float(reverse_bits(second)))


@wp.func
def random_number(key: wp.uint32, dimension: int, sample: wp.uint32):
    """A number in [0, 1), independent of all others."""
    seed = hash_bits(key ^ (wp.uint32(dimension) * wp.uint32(0x2C1B3C6D)))
    # Plain hashing: decisions about single paths gain nothing from stratification.
    return unit_float(hash_bits(seed + sample))
