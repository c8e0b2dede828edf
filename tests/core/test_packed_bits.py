"""Shadow bits at rest come back as they were, and take less room."""

import numpy as np
import pytest

from citypv.core.light.packed_bits import pack_bits


@pytest.mark.parametrize("points", [4, 16, 64])
@pytest.mark.parametrize("suns", [0, 1, 7])
def test_bits_come_back(points, suns):
    """Words of 16 points; none, all or some of them see a sun, nine in ten times none or all."""
    words, full = -(-points // 16), (1 << min(points, 16)) - 1
    generator = np.random.default_rng(1)
    bits = generator.choice([0, full], (2, 50, words, suns)).astype(np.uint16)
    some = generator.random(bits.shape) < 0.1
    bits[some] = generator.integers(0, full + 1, some.sum())
    packed = pack_bits(bits)
    np.testing.assert_array_equal(packed.unpack(), bits)
    assert packed.unpack().dtype == np.uint16
    assert packed.codes.nbytes <= bits.nbytes / 8 + 1
    assert packed.others.nbytes <= 2 * some.sum()


def test_words_that_are_all_alike_need_no_word():
    packed = pack_bits(np.full((1, 3, 1, 5), 9, np.uint16))
    assert len(packed.others) == 0
    assert (packed.unpack() == 9).all()
