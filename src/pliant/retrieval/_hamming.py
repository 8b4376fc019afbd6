"""Nearest binary codes in memory, on faiss: exact up to millions of codes, by inverted lists beyond."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np

from .._arrays import IntArray
from ..errors import InputError, require
from .bits import Codes

IndexKind: TypeAlias = Literal["auto", "flat", "ivf"]

#: Codes up to which ``"auto"`` compares with every code: about 1.2 ms a million 128-bit codes.
FLAT_UP_TO = 4_000_000
_TRAINING_CODES_A_LIST = 64
_MOST_LISTS = 2048
# A list in eight is looked into; the rest is what the lists save.
_LISTS_A_PROBE = 8


class HammingSearch:
    """Codes with ascending ids, and the search among them.

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8.
    kind : {"auto", "flat", "ivf"}
    flat_up_to : int
        Codes past which ``"auto"`` builds inverted lists.
    """

    def __init__(self, bits: int, kind: IndexKind = "auto", flat_up_to: int = FLAT_UP_TO) -> None:
        self.bits, self.kind, self.flat_up_to = bits, kind, flat_up_to
        self.ids: IntArray = np.zeros(0, dtype=np.int64)
        self.labels: IntArray = np.zeros(0, dtype=np.int64)
        self._lists: Any = None
        self._flat = self._empty_flat()

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def exact(self) -> bool:
        """Whether every code is compared."""
        return self._lists is None

    @property
    def codes(self) -> Codes:
        """A view of all codes, in the order of their ids; void once codes are added or removed."""
        if not len(self.ids):
            return np.zeros((0, self.bits // 8), dtype=np.uint8)
        faiss = _faiss()
        whole: Codes = faiss.rev_swig_ptr(self._flat.xb.data(), len(self.ids) * self.bits // 8)
        return whole.reshape(len(self.ids), self.bits // 8)

    def extend(self, ids: IntArray, codes: Codes, labels: IntArray, *, in_lists: bool = False) -> None:
        """Append codes; their ids ascend and are greater than all before. ``in_lists``: the lists have them."""
        if not len(ids):
            return
        self._flat.add(np.ascontiguousarray(codes))
        self.ids = np.concatenate([self.ids, ids])
        self.labels = np.concatenate([self.labels, labels])
        if self._lists is not None and not in_lists:
            self._lists.add_with_ids(np.ascontiguousarray(codes), ids)
        elif self._lists is None and self._wants_lists():
            self._lists = self._built_lists()

    def discard(self, ids: IntArray) -> None:
        """Take codes out; the others keep their order."""
        places = np.flatnonzero(np.isin(self.ids, ids))
        if not len(places):
            return
        faiss = _faiss()
        gone = np.ascontiguousarray(self.ids[places])
        self._flat.remove_ids(faiss.IDSelectorBatch(places))
        if self._lists is not None:
            self._lists.remove_ids(faiss.IDSelectorBatch(gone))
        self.ids, self.labels = np.delete(self.ids, places), np.delete(self.labels, places)

    def nearest(self, queries: Codes, count: int, label: int | None = None) -> tuple[IntArray, IntArray]:
        """Return distances and ids of the nearest codes, by distance and then by id.

        Inverted lists can miss codes; what they miss is -1 with distance ``bits + 1``. Among codes of one label every
        one is compared.
        """
        if label is not None:
            return self._among(np.flatnonzero(self.labels == label), queries, count)
        count = min(count, len(self))
        if self._lists is None:
            distances, places = self._flat.search(queries, count)
            return distances.astype(np.int64), self.ids[places]
        return self._in_lists(queries, count)

    def to_bytes(self) -> bytes:
        """Serialise what faiss holds: the lists where there are any, all codes otherwise."""
        faiss = _faiss()
        serialised: bytes = faiss.serialize_index_binary(self._flat if self.exact else self._lists).tobytes()
        return serialised

    def restore(self, data: bytes, ids: IntArray, labels: IntArray, codes: Codes | None) -> bool:
        """Take back what :meth:`to_bytes` wrote for these ids; False where it does not fit them.

        Only for bytes whose hash is known: faiss's reader is not made for hostile ones. ``codes`` are needed where the
        bytes are inverted lists.
        """
        faiss = _faiss()
        try:
            index = faiss.downcast_IndexBinary(
                faiss.deserialize_index_binary(np.frombuffer(data, dtype=np.uint8))
            )
        except RuntimeError:
            return False
        if index.d != self.bits or index.ntotal != len(ids):
            return False
        if isinstance(index, faiss.IndexBinaryIVF):
            if codes is None or len(codes) != len(ids):
                return False
            faiss.downcast_IndexBinary(index.quantizer).use_heap = False
            self._lists = index
            self.extend(ids, codes, labels, in_lists=True)
            return True
        if not isinstance(index, faiss.IndexBinaryFlat) or self._wants_lists(len(ids)):
            return False
        index.use_heap = False
        self._flat, self.ids, self.labels = index, ids, labels
        return True

    def _empty_flat(self) -> Any:
        flat = _faiss().IndexBinaryFlat(self.bits)
        # Counting keeps, at each distance, the first codes of the scan: ties go to the lower id, exactly.
        flat.use_heap = False
        return flat

    def _wants_lists(self, count: int | None = None) -> bool:
        count = len(self) if count is None else count
        return self.kind == "ivf" or (self.kind == "auto" and count > self.flat_up_to)

    def _built_lists(self) -> Any:
        faiss = _faiss()
        count = int(np.clip(np.sqrt(len(self)), 1, _MOST_LISTS))
        quantiser = faiss.IndexBinaryFlat(self.bits)
        quantiser.use_heap = False
        lists = faiss.IndexBinaryIVF(quantiser, self.bits, count)
        lists.own_fields = True
        quantiser.this.disown()
        lists.cp.min_points_per_centroid = 1
        lists.nprobe = max(1, count // _LISTS_A_PROBE)
        size = min(len(self), _TRAINING_CODES_A_LIST * count)
        sample = np.random.default_rng(0).choice(len(self), size, replace=False)
        lists.train(np.ascontiguousarray(self.codes[np.sort(sample)]))
        lists.add_with_ids(self.codes, self.ids)
        return lists

    def _in_lists(self, queries: Codes, count: int) -> tuple[IntArray, IntArray]:
        found = [self._one_in_lists(query[None], count) for query in queries]
        distances = np.array([row[0] for row in found], dtype=np.int64)
        return distances.reshape(len(queries), count), np.array([row[1] for row in found]).reshape(
            distances.shape
        )

    def _one_in_lists(self, query: Codes, count: int) -> tuple[IntArray, IntArray]:
        """Search twice: the first finds how far to look, the second everything there, so that ties can be cut by id."""
        farthest = int(self._lists.search(query, count)[0].max())
        if farthest > self.bits:  # The lists hold too few, and faiss fills up with a very great distance.
            farthest = self.bits
        _, distances, ids = self._lists.range_search(query, farthest + 1)
        distances = distances.astype(np.int64)
        order = np.lexsort((ids, distances))[:count]
        missing = count - len(order)
        return (
            np.append(distances[order], np.full(missing, self.bits + 1)),
            np.append(ids[order], np.full(missing, -1)),
        )

    def _among(self, places: IntArray, queries: Codes, count: int) -> tuple[IntArray, IntArray]:
        count = min(count, len(places))
        if not count:
            none = np.zeros((len(queries), 0), dtype=np.int64)
            return none, none.copy()
        distances, rows = _faiss().knn_hamming(
            queries, np.ascontiguousarray(self.codes[places]), count, variant="mc"
        )
        return distances.astype(np.int64), self.ids[places[rows]]


def checked_codes(codes: Any, bits: int | None = None) -> Codes:
    """Coerce packed codes to (m, bits / 8) uint8, or say what is wrong with them."""
    array = np.asarray(codes)
    if array.ndim != 2 or array.dtype != np.uint8 or not array.shape[1]:
        message = (
            f"codes must be packed bits, an (m, bits / 8) array of uint8, got shape {array.shape} of {array.dtype}; "
            "np.packbits(bits, axis=1, bitorder='little') packs them"
        )
        raise InputError(message)
    if bits is not None and array.shape[1] * 8 != bits:
        message = f"the codes have {array.shape[1] * 8} bits and the index has {bits}; encode with the index's model"
        raise InputError(message)
    return np.ascontiguousarray(array)


def _faiss() -> Any:
    return require("faiss", "retrieval")
