"""Well-spread random points that depend on nothing but (seed, pixel, sample, pair): Owen-scrambled Sobol points.

Compiled; arguments are taken to be right. All words are uint64 that hold 32 bits, because numba would turn a mixture of
signed and unsigned words into floats.
Sources: Sobol' (0, 2)-sequence and its Pascal matrix, Ahmed 2024, "An implementation algorithm of 2D Sobol sequence
fast, elegant, and compact"; scrambling by hashing, Burley 2020, "Practical hash-based Owen scrambling" (Laine-Karras
hash with Vegdahl's constants); splitmix64, Steele et al. 2014.
"""

import numpy as np

from bvbedit.jit import inlined_kernel

U = np.uint64
WORD = U(0xFFFFFFFF)
ONE, TWO, FOUR, EIGHT, SIXTEEN = U(1), U(2), U(4), U(8), U(16)
# Masks that select every other group of 1, 2, 4, 8, 16 bits, the lower of each two.
LOW1, LOW2, LOW4, LOW8, LOW16 = U(0x55555555), U(0x33333333), U(0x0F0F0F0F), U(0x00FF00FF), U(0x0000FFFF)
HASH1, HASH2, HASH3, HASH4 = U(0x6C50B47C), U(0xB82F1E52), U(0xC7AFE638), U(0x8D22F6E6)
GOLDEN, MIX1, MIX2 = U(0x9E3779B97F4A7C15), U(0xBF58476D1CE4E5B9), U(0x94D049BB133111EB)
SHIFT30, SHIFT27, SHIFT31, SHIFT32 = U(30), U(27), U(31), U(32)
TO_UNIT = 2.0**-32


@inlined_kernel
def mix(state: U, counter: U) -> U:
    """Hash a state and a counter into 64 well-mixed bits (splitmix64)."""
    z = state + (counter + ONE) * GOLDEN
    z = (z ^ (z >> SHIFT30)) * MIX1
    z = (z ^ (z >> SHIFT27)) * MIX2
    return z ^ (z >> SHIFT31)


@inlined_kernel
def reverse(x: U) -> U:
    """Reverse the order of 32 bits."""
    x = ((x >> ONE) & LOW1) | ((x & LOW1) << ONE)
    x = ((x >> TWO) & LOW2) | ((x & LOW2) << TWO)
    x = ((x >> FOUR) & LOW4) | ((x & LOW4) << FOUR)
    x = ((x >> EIGHT) & LOW8) | ((x & LOW8) << EIGHT)
    return (x >> SIXTEEN) | ((x & LOW16) << SIXTEEN)


@inlined_kernel
def scramble(x: U, seed: U) -> U:
    """Owen-scramble a word whose bits are reversed: each bit is flipped by a hash of the bits below it."""
    x = (x + seed) & WORD
    x ^= (x * HASH1) & WORD
    x ^= (x * HASH2) & WORD
    x ^= (x * HASH3) & WORD
    x ^= (x * HASH4) & WORD
    return x


@inlined_kernel
def point(state: U, sample: int, pair: int) -> tuple[float, float]:
    """Return point ``sample`` in [0, 1)^2 of the sequence with hashed ``state``; each ``pair`` is its own sequence.

    Any 2^k first points are a (0, 2)-net: one in each of the 2^k boxes of every shape.
    """
    keys, more = mix(state, U(2 * pair)), mix(state, U(2 * pair + 1))
    # Shuffle the order, so that different pairs of one pixel are independent of one another.
    index = reverse(scramble(reverse(U(sample)), keys & WORD))
    # The first Sobol' coordinate is the index with reversed bits, the second the index times Pascal's matrix modulo 2.
    second = index
    second ^= (second >> ONE) & LOW1
    second ^= (second >> TWO) & LOW2
    second ^= (second >> FOUR) & LOW4
    second ^= (second >> EIGHT) & LOW8
    second ^= (second >> SIXTEEN) & LOW16
    u = reverse(scramble(index, keys >> SHIFT32))
    v = reverse(scramble(second, more & WORD))
    return float(u) * TO_UNIT, float(v) * TO_UNIT
