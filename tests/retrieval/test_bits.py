"""Packing, and the distances of what is packed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import InputError
from pliant.retrieval import hamming_distances, pack_bits, unpack_bits


@pytest.mark.parametrize("bit", [0, 1, 7, 8, 13, 127])
def test_bit_j_is_bit_j_mod_8_of_byte_j_over_8(bit: int) -> None:
    table = np.zeros((1, 128), dtype=bool)
    table[0, bit] = True
    code = pack_bits(table)
    assert code.shape == (1, 16)
    assert code[0, bit // 8] == 1 << (bit % 8)
    assert code.sum() == 1 << (bit % 8)


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 6))
def test_unpacking_undoes_packing_and_distances_count_bits(seed: int, rows: int, octets: int) -> None:
    table = np.random.default_rng(seed).random((rows, 8 * octets)) < 0.5
    codes = pack_bits(table)
    assert np.array_equal(unpack_bits(codes), table)
    assert np.array_equal(hamming_distances(codes, codes), (table[:, None] != table).sum(axis=2))


def test_distances_are_those_of_faiss() -> None:
    faiss = pytest.importorskip("faiss")
    rng = np.random.default_rng(0)
    codes = rng.integers(0, 256, (50, 16), dtype=np.uint8)
    index = faiss.IndexBinaryFlat(128)
    index.add(codes)
    distances, places = index.search(codes[:7], 50)
    ours = hamming_distances(codes[:7], codes)
    assert np.array_equal(np.take_along_axis(ours, places, axis=1), distances)


@pytest.mark.parametrize("bad", [np.zeros((2, 12)), np.zeros(8), np.zeros((2, 0))])
def test_only_whole_bytes_are_packed(bad: np.ndarray) -> None:
    with pytest.raises(InputError, match="multiple of 8"):
        pack_bits(bad)


@pytest.mark.parametrize("bad", [[[256]], [[-1]], [[0.5]], [1, 2]])
def test_codes_are_rows_of_bytes(bad: list) -> None:
    with pytest.raises(InputError, match="must be bytes"):
        unpack_bits(bad)


def test_codes_of_two_lengths_have_no_distance() -> None:
    with pytest.raises(InputError, match="8 and 16 bits"):
        hamming_distances([[1]], [[1, 2]])
