"""A trained model: from pictures to packed codes, kept in a folder without pickle."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..errors import FileFormatError, InputError
from ..mesh import load_arrays, save_arrays
from ..mesh.formats.raw import write_atomically
from ._coder import Coder
from .bits import Codes
from .codes import IterativeQuantization, LocalitySensitiveHashing, SpectralHashing
from .discriminative import DiscriminativeBinaryCodes
from .supervised import CCAIterativeQuantization, ClassifierCodes
from .vocabulary import Vocabulary, describe_picture

__all__ = ["CODERS", "RetrievalModel"]

#: Kinds of codes by the name that a model's file gives them.
CODERS: Mapping[str, type[Coder]] = {
    "proposed": DiscriminativeBinaryCodes,
    "lsh": LocalitySensitiveHashing,
    "itq": IterativeQuantization,
    "cca_itq": CCAIterativeQuantization,
    "spectral": SpectralHashing,
    "classifier": ClassifierCodes,
}
# Raised when what the folder holds changes; newer ones are refused.
_FORMAT = 1
_ARRAYS, _SETTINGS = "model.npz", "model.json"


@dataclass(frozen=True, eq=False)
class RetrievalModel:
    """A vocabulary and codes that were learned together.

    Attributes
    ----------
    vocabulary : Vocabulary
        Fitted.
    codes : DiscriminativeBinaryCodes or another kind of code
        Fitted on histograms of the vocabulary.
    settings : dict
        How pictures are described (``points``, ``seed``) and what made the model; JSON.
    """

    vocabulary: Vocabulary
    codes: Any
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def bits(self) -> int:
        """Length of a code."""
        return int(self.codes.bits)

    def encode(self, pictures: Iterable[Any]) -> Codes:
        """Return the codes of pictures.

        Parameters
        ----------
        pictures : iterable of Picture, str, Path, or array_like
            See :func:`pliant.images.as_picture`.

        Returns
        -------
        (m, bits / 8) array of uint8
            See :func:`pack_bits` for the order of bits.

        Raises
        ------
        InputError
            If a picture cannot be used: too small, of one colour, not a picture.

        Notes
        -----
        About 40 ms a picture on one core.
        """
        return self.encode_descriptors(
            describe_picture(
                picture, points=int(self.settings.get("points", 600)), rng=int(self.settings.get("seed", 0))
            ).descriptors
            for picture in pictures
        )

    def encode_descriptors(self, descriptors: Iterable[NDArray[Any]]) -> Codes:
        """Return the codes of pictures of which the descriptors are known, (m, bits / 8)."""
        histograms = self.vocabulary.transform(descriptors)
        if not len(histograms):
            return np.zeros((0, self.bits // 8), dtype=np.uint8)
        codes: Codes = self.codes.transform(histograms)
        return codes

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write ``model.npz`` and ``model.json`` into a folder; each appears whole or not at all.

        Raises
        ------
        InputError
            If the codes are of a kind that has no name in a file.
        """
        kinds = [name for name, kind in CODERS.items() if type(self.codes) is kind]
        if not kinds:
            message = f"codes of kind {type(self.codes).__name__} cannot be kept in a file"
            raise InputError(message)
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        facts = {
            "format": _FORMAT,
            "version": __version__,
            "codes": {"kind": kinds[0], "parameters": _plain(self.codes.get_params())},
            "vocabulary": {"parameters": _plain(self.vocabulary.get_params())},
            "settings": self.settings,
        }
        arrays = {f"vocabulary.{k}": v for k, v in self.vocabulary.state().items()}
        arrays |= {f"codes.{k}": v for k, v in self.codes.state().items()}
        text = json.dumps(facts, indent=2, allow_nan=False)
        # The facts travel inside the arrays' file too: two files can never tell of different models.
        arrays["facts"] = np.frombuffer(text.encode(), dtype=np.uint8)
        save_arrays(place / _ARRAYS, arrays)
        write_atomically(place / _SETTINGS, (text + "\n").encode())

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> Self:
        """Read a model that :meth:`save` wrote. Nothing is unpickled.

        Raises
        ------
        FileFormatError
            If a file is missing, damaged, or was written by a newer version.
        """
        path = Path(folder) / _ARRAYS
        try:
            arrays = load_arrays(path)
            facts = json.loads(arrays["facts"].tobytes())
            form = int(facts["format"])
        except FileFormatError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            message = f"{path} is not a model, or is damaged: {error}"
            raise FileFormatError(message) from error
        if form > _FORMAT:
            message = (
                f"{path} was written by version {facts.get('version')} (format {form}); this one reads up to "
                f"format {_FORMAT}: update Pliant"
            )
            raise FileFormatError(message)
        try:
            kind = CODERS[facts["codes"]["kind"]]
            vocabulary = Vocabulary(**facts["vocabulary"]["parameters"])
            codes = kind(**facts["codes"]["parameters"])
            return cls(
                vocabulary.with_state(_part(arrays, "vocabulary.")),
                codes.with_state(_part(arrays, "codes.")),
                dict(facts["settings"]),
            )
        except (KeyError, TypeError, InputError) as error:
            message = f"{path} is damaged: {error}"
            raise FileFormatError(message) from error


def _plain(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out generators: what they drew is in the arrays."""
    return {name: value for name, value in parameters.items() if not isinstance(value, np.random.Generator)}


def _part(arrays: Mapping[str, NDArray[Any]], prefix: str) -> dict[str, NDArray[Any]]:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
