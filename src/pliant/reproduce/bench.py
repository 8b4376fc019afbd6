"""What an experiment works with: the data there is, how much time to take, and where pictures go."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ..mesh import Mesh
from ..mesh.formats import write_atomically
from ..report import surface_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Bench", "Picture"]


@dataclass(frozen=True)
class Picture:
    """A figure, or a surface that turns, as a file beside the results.

    Parameters
    ----------
    file : str
        Name of the file.
    caption : str
        What it shows; also what a screen reader says.
    kind : {"figure", "surface"}
        PNG, or a page.
    """

    file: str
    caption: str
    kind: str


@dataclass
class Bench:
    """What an experiment works with.

    Parameters
    ----------
    name : str
        The experiment's name: pictures' names begin with it.
    folder : Path
        Where its pictures go.
    data : Path, optional
        The evaluation data, laid out as :func:`pliant.datasets.registry` says.
    quick : bool
        Fewer shapes, draws and subjects; the findings say how many.
    seed : int
        Of everything random.
    """

    name: str
    folder: Path
    data: Path | None = None
    quick: bool = False
    seed: int = 0
    pictures: list[Picture] = field(default_factory=list)

    def path(self, part: str) -> Path | None:
        """Return a folder or file of the data, or None where it is not there."""
        found = None if self.data is None else self.data / part
        return found if found is not None and found.exists() else None

    def figure(self, figure: Figure, caption: str) -> None:
        """Keep a figure."""
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=144, facecolor="white", metadata={"Software": None})
        self._keep(buffer.getvalue(), caption, "figure")

    def surface(
        self, mesh: Mesh, layers: Mapping[str, ArrayLike], caption: str, *, up: str = "z", unit: str = ""
    ) -> None:
        """Keep a surface that turns, with a vertex picker."""
        page = surface_page(mesh, layers, title=caption, up=up, length_unit=unit)  # type: ignore[arg-type]
        self._keep(page.encode(), caption, "surface")

    def _keep(self, content: bytes, caption: str, kind: str) -> None:
        ending = "png" if kind == "figure" else "html"
        picture = Picture(f"{self.name}-{len(self.pictures) + 1}.{ending}", caption, kind)
        write_atomically(self.folder / picture.file, content)
        self.pictures.append(picture)
