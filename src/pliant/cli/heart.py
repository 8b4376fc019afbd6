"""``pliant heart``: the left ventricle, from a CT volume to a bull's-eye; segmentation and phantoms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from .files import write_json
from .output import given, named, output_folder, say, say_json, show_facts

heart = typer.Typer(
    name="heart",
    help="The left ventricle, from a CT volume to a bull's-eye. Research software, not a medical device.",
    no_args_is_help=True,
)

_MASKS = (".nii.gz", ".nii", ".nrrd", ".mha")

Numbers = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="A point in the ventricle's blood, RAS mm.")
]
Plane = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z,NX,NY,NZ", help="A point of the basal plane and a direction across it, RAS mm."
    ),
]


@heart.command()
def segment(
    volume: Annotated[
        Path,
        typer.Argument(metavar="VOLUME", callback=given, help="Folder of DICOM slices, NIfTI, NRRD or MHA."),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            callback=named(*_MASKS),
            help="Mask to write, on the volume's grid.",
        ),
    ],
    method: Annotated[
        Literal["threshold", "region", "edge"],
        typer.Option(help="Threshold, or a level set by region or by edges."),
    ] = "threshold",
    smoothing: Annotated[
        Literal["gaussian", "median"], typer.Option(help="Filter before that.")
    ] = "gaussian",
    width: Annotated[float | None, typer.Option(help="Sigma or edge of the filter, in mm.")] = None,
    basal_plane: Plane = None,
    seed: Numbers = None,
    near: Annotated[
        Path | None,
        typer.Option(metavar="FILE", callback=given, help="Mask of where to look, on the volume's grid."),
    ] = None,
    series: Annotated[
        str | None, typer.Option(help="DICOM series to read where a folder holds several.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")
    ] = False,
) -> None:
    """Segment the blood pool of the left ventricle in a contrast CT."""
    from ..heart import load_volume, save_mask, segment_blood_pool

    plane = _numbers(basal_plane, 6, "--basal-plane")
    image = load_volume(volume, modality="CT", series=series)
    pool = segment_blood_pool(
        image,
        method=method,
        smoothing=smoothing,
        width=width,
        basal_plane=None if plane is None else (plane[:3], plane[3:]),
        seed=_numbers(seed, 3, "--seed"),
        mask=None if near is None else load_volume(near).values > 0,
        progress=not as_json,
    )
    save_mask(pool.mask, image, out)
    point, normal = (part.round(3).tolist() for part in pool.basal_plane)
    summary: dict[str, Any] = {
        "millilitres": round(pool.millilitres, 2),
        "basal_plane": {"point": point, "normal": normal},
        "confidence": round(pool.confidence, 3),
        "leak": pool.leak,
        "warnings": list(pool.warnings),
        "settings": dict(pool.settings),
        "written": str(out),
    }
    if as_json:
        say_json(summary)
        return
    facts = {
        "blood": f"{pool.millilitres:.1f} ml",
        "basal plane at": f"{point}, across {normal} (RAS mm)",
        "confidence": f"{pool.confidence:.2f}",
        "leak": "yes, see the warnings" if pool.leak else "none found",
    }
    show_facts(
        f"Left ventricle of {volume.name}",
        facts | {k.replace("_", " "): str(v) for k, v in pool.settings.items()},
    )
    say(f"wrote {out}")


@heart.command()
def phantom(
    out: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            callback=output_folder,
            help="Folder to write; a run resumes there.",
        ),
    ],
    count: Annotated[
        int, typer.Option(min=2, help="Subjects, 2 at least; half of them without disease.")
    ] = 32,
    change: Annotated[
        Literal["mixed", "height", "spacing", "direction", "smoothing", "none"],
        typer.Option(help="What stenosis does to trabeculae; none makes a null cohort."),
    ] = "mixed",
    spacing: Annotated[float, typer.Option(help="Spacing of the CT volumes, in mm.")] = 1.0,
    mesh_step: Annotated[float, typer.Option(help="Step of the exact meshes, in mm.")] = 1.0,
    noise: Annotated[float, typer.Option(min=0, help="Standard deviation of a voxel, in HU.")] = 47.0,
    volumes: Annotated[bool, typer.Option(help="Write CT volumes and masks, not only meshes.")] = True,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the cohort.")] = 0,
) -> None:
    """Make a cohort of hearts whose surface, segments and stenoses are known."""
    from .. import __version__
    from ..heart import phantom_cohort

    cohort = phantom_cohort(count, change=change, rng=seed, spacing=spacing, mesh_step=mesh_step, noise=noise)
    settings = {
        "count": count,
        "change": change,
        "spacing": spacing,
        "mesh_step": mesh_step,
        "noise": noise,
        "seed": seed,
        "pliant": __version__,
    }
    out.mkdir(parents=True, exist_ok=True)
    _refuse_other_cohort(out / "settings.json", settings)
    table = cohort.save(out, volumes=volumes, progress=True)
    say(f"wrote {table}: {count} subjects, {int(cohort.diseased.sum())} with disease")


def _refuse_other_cohort(path: Path, settings: dict[str, Any]) -> None:
    """Keep a run from resuming in a folder that holds other hearts."""
    if path.exists() and json.loads(path.read_text(encoding="utf-8")) != settings:
        message = (
            f"{path.parent} holds a cohort made with other settings (see {path.name}); choose another folder"
        )
        raise typer.BadParameter(message)
    write_json(path, settings)


def _numbers(text: str | None, count: int, name: str) -> list[float] | None:
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError as error:
        message = f"{name}: {text!r} is not a list of numbers"
        raise typer.BadParameter(message) from error
    if len(values) != count:
        message = f"{name} needs {count} numbers, got {len(values)}"
        raise typer.BadParameter(message)
    return values
