"""Options that commands about one heart share: where it is read from, and how it is described."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from .ending import complain
from .output import given, load_examined

if TYPE_CHECKING:
    from ..heart import HeartDescription

Landmarks = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        callback=given,
        help="JSON with any of apex, base (3 numbers), septum (3 x 3), in RAS mm.",
    ),
]
Mask = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", callback=given, help="Blood pool on the volume's grid, instead of finding it."
    ),
]
Right = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", callback=given, help="Mask of the right ventricle, instead of septal landmarks."
    ),
]
Points = Annotated[int, typer.Option(min=10, help="Points a segment.")]
Radius = Annotated[float, typer.Option(help="Scale of the curvatures, in mm.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of every draw.")]
Jobs = Annotated[
    int | None, typer.Option(min=1, help="Threads, or processes of a cohort; all cores without it.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]
Source = Annotated[
    Path,
    typer.Argument(
        metavar="INPUT", callback=given, help="A CT (folder of DICOM, NIfTI, NRRD, MHA) or a surface mesh."
    ),
]

_MESHES = (".ply", ".vtk", ".vtp", ".vtu", ".obj", ".off", ".stl", ".gii")


@dataclass(frozen=True)
class Patient:
    """One heart and how it is to be described: each field is an option of a command that takes a patient."""

    source: Source
    landmarks: Landmarks = None
    mask: Mask = None
    right_ventricle: Right = None
    points: Points = 500
    radius: Radius = 3.0
    seed: Seed = 0
    jobs: Jobs = None

    def described(self, *, progress: bool) -> HeartDescription:
        """Describe the heart, cautions on standard error."""
        from ..heart import describe_heart, load_volume, read_heart_landmarks

        source = self.source
        is_mesh = source.is_file() and source.name.lower().removesuffix(".gz").endswith(_MESHES)
        found = describe_heart(
            load_examined(source)[0] if is_mesh else load_volume(source),
            mask=None if self.mask is None else load_volume(self.mask).values > 0.5,
            landmarks=read_heart_landmarks(self.landmarks) if self.landmarks else None,
            right_ventricle=None if self.right_ventricle is None else load_volume(self.right_ventricle),
            points=self.points,
            radius=self.radius,
            rng=self.seed,
            n_jobs=self.jobs,
            progress=progress,
        )
        for text in found.cautions:
            complain("warning", text)
        return found


def takes_patient(command: Callable[..., None]) -> Callable[..., None]:
    """Show a command's parameter ``patient`` to the shell as the options of :class:`Patient`."""
    hints = get_type_hints(Patient, include_extras=True)
    options = [
        inspect.Parameter(
            part.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if part.default is MISSING else part.default,
            annotation=hints[part.name],
        )
        for part in fields(Patient)
    ]
    own = [
        # Keyword-only, so that options without a default may follow options that have one.
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in inspect.signature(command, eval_str=True).parameters.values()
        if parameter.name != "patient"
    ]

    @functools.wraps(command)
    def run(**given: Any) -> None:
        patient = Patient(**{part.name: given.pop(part.name) for part in fields(Patient)})
        command(patient=patient, **given)

    shown = inspect.Signature([*options[:1], *own[:1], *options[1:], *own[1:]])
    run.__signature__ = shown  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in shown.parameters.values()}
    return run
