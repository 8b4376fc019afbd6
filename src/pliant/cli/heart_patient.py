"""``pliant heart surface``, ``segments``, ``describe`` and ``report``: from a blood pool to a bull's-eye."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from .ending import complain
from .files import write_figure, write_rows, write_text
from .heart import heart as heart
from .heart_options import AsJson, Landmarks, Mask, Patient, Right, takes_patient
from .output import MeshOutput, given, load_examined, named, output_folder, say, say_json, show_facts

if TYPE_CHECKING:
    from ..heart import HeartDescription


@heart.command()
def surface(
    volume: Annotated[
        Path, typer.Argument(metavar="VOLUME", callback=given, help="The image, or a mask of 0 and 1.")
    ],
    out: MeshOutput,
    mask: Mask = None,
    level: Annotated[float | None, typer.Option(help="Value between blood and wall.")] = None,
    denoising: Annotated[
        Literal["normals", "diffusion", "none"], typer.Option(help="How to denoise.")
    ] = "normals",
    rounds: Annotated[int | None, typer.Option(min=0, help="Rounds of denoising; 10 without it.")] = None,
    step: Annotated[
        float, typer.Option(min=0.0, help="Length of the grid's step in mm; 0 for the volume's own.")
    ] = 1.0,
    as_json: AsJson = False,
) -> None:
    """Triangulate the surface of the blood: closed, one piece, denoised, its volume kept."""
    from .. import save_mesh
    from ..heart import endocardial_surface, load_volume

    image = load_volume(volume)
    inside = None if mask is None else load_volume(mask).values > 0.5
    found = endocardial_surface(
        image, mask=inside, level=level, denoising=denoising, rounds=rounds, step=step
    )
    save_mesh(out, found.mesh)
    facts = {
        "vertices": found.mesh.n_vertices, "millilitres": round(found.volume_ml, 2), "genus": found.genus,
        "change_by_denoising": found.volume_change, "dropped": found.dropped, **found.settings, "written": str(out),
    }  # fmt: skip
    _show("Surface", facts, as_json)


@heart.command()
def segments(
    mesh: Annotated[
        Path, typer.Argument(metavar="MESH", callback=given, help="Endocardial surface in RAS mm.")
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", callback=named(".csv"), help="CSV to write: vertex, segment."
        ),
    ],
    landmarks: Landmarks = None,
    right_ventricle: Right = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            callback=named(".png", ".pdf", ".svg"),
            help="Also draw the segments: .png, .pdf, .svg.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Label every vertex with its AHA segment, 1 to 17, or 0 on the cut at the base."""
    import numpy as np

    from ..heart import aha_segments, load_volume, read_heart_landmarks, ventricle_frame

    shape, _ = load_examined(mesh)
    marks: dict[str, Any] = dict(read_heart_landmarks(landmarks)) if landmarks else {}
    right = None if right_ventricle is None else load_volume(right_ventricle)
    frame = ventricle_frame(shape, right_ventricle=right, **marks)
    labels = aha_segments(shape, frame)
    write_rows(out, ("vertex", "segment"), enumerate(labels.tolist()))
    if figure is not None:
        from ..report import segment_figure

        write_figure(figure, segment_figure(shape, labels, frame, title="AHA segments"))
    facts: dict[str, Any] = {
        "vertices": shape.n_vertices, "rotation_from": frame.origin, "confidence": round(frame.confidence, 3),
        "axis_mm": round(frame.length, 2), "apex": frame.apex.round(2).tolist(), "base": frame.base.round(2).tolist(),
    }  # fmt: skip
    counts = np.bincount(labels, minlength=18).tolist()
    if as_json:
        facts["vertices_of_segments"] = counts
    else:
        facts["vertices of a segment"] = f"{min(counts[1:])} to {max(counts[1:])}, on the cut {counts[0]}"
    if frame.confidence < 0.5:
        complain(
            "warning", f"rotation {frame.origin}, confidence {frame.confidence:.2f}: give septal landmarks"
        )
    _show("Segments", facts | {"written": str(out)}, as_json)


@heart.command()
@takes_patient
def describe(
    out: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            callback=named(".npz", ".csv"),
            help="Arrays to write: .npz, or .csv of segments.",
        ),
    ],
    patient: Patient,
    as_json: AsJson = False,
) -> None:
    """Measure 23 numbers at points of every segment, the roughness of each, and the cavity."""
    from .. import save_arrays

    found = patient.described(progress=not as_json)
    features = found.features
    if out.suffix.lower() == ".npz":
        arrays = ("values", "segments", "vertices", "roughness", "areas")
        save_arrays(out, {**{name: getattr(features, name) for name in arrays}, "labels": found.labels})
    else:
        _write_segments(out, found)
    facts = {
        "points": len(features.values), "missing": features.n_missing,
        "roughness_per_mm": round(features.roughness[0], 4),
        "cavity_ml": _number(features.cavity_ml), "axis_mm": round(features.axis_mm, 1),
        "sphericity": _number(features.sphericity), "cautions": list(found.cautions), "written": str(out),
    }  # fmt: skip
    _show("Ventricle", facts, as_json)


@heart.command()
@takes_patient
def report(
    out: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            callback=output_folder,
            help="Folder for the page, figures and tables.",
        ),
    ],
    patient: Patient,
    as_json: AsJson = False,
) -> None:
    """Take one patient from a CT to one HTML page. Research software, not a medical device."""
    from .. import __version__, save_mesh
    from ..heart import save_mask
    from ..report import bulls_eye_figure, heart_page, segment_figure, write_page

    found = patient.described(progress=not as_json)
    out.mkdir(parents=True, exist_ok=True)
    settings = {"input": patient.source.name, "pliant": __version__}
    write_page(
        out / "report.html",
        heart_page(found, title=f"Left ventricle: {patient.source.name}", settings=settings),
    )
    save_mesh(out / "endocardium.ply", found.mesh)
    _write_segments(out / "segments.csv", found)
    rough = found.features.roughness[1:]
    rough_figure = bulls_eye_figure(rough, title="Roughness", label="mean curvedness (1/mm)")
    write_figure(out / "bulls_eye.png", rough_figure)
    drawn = segment_figure(found.mesh, found.labels, found.frame, title="AHA segments")
    write_figure(out / "segments.png", drawn)
    steps = {
        **settings,
        "steps": {k: dict(v) for k, v in found.steps.items()},
        "cautions": list(found.cautions),
    }
    write_text(out / "steps.json", json.dumps(steps, indent=2, default=_plain) + "\n")
    written = [
        "report.html",
        "endocardium.ply",
        "segments.csv",
        "bulls_eye.png",
        "segments.png",
        "steps.json",
    ]
    if found.volume is not None and found.mask is not None:
        save_mask(found.mask, found.volume, out / "blood_pool.nii.gz")
        written.append("blood_pool.nii.gz")
    facts = {
        "cavity_ml": _number(found.features.cavity_ml), "axis_mm": round(found.features.axis_mm, 1),
        "sphericity": _number(found.features.sphericity), "cautions": list(found.cautions),
        "written": [str(out / name) for name in written],
    }  # fmt: skip
    _show("Left ventricle (research software, not a medical device)", facts, as_json)


def _write_segments(path: Path, found: HeartDescription) -> None:
    from ..heart import SEGMENT_NAMES, TERRITORIES

    of = {s: name for name, numbers in TERRITORIES.items() for s in numbers}
    rows = (
        (
            s,
            SEGMENT_NAMES[s - 1],
            of[s],
            f"{found.features.areas[s]:.6g}",
            f"{found.features.roughness[s]:.6g}",
        )
        for s in range(1, 18)
    )
    write_rows(path, ("segment", "name", "territory", "area_mm2", "roughness_per_mm"), rows)


def _show(title: str, facts: dict[str, Any], as_json: bool) -> None:
    if as_json:
        say_json(json.loads(json.dumps(facts, default=_plain)))
        return
    written = facts.get("written", [])
    # Cautions are on standard error already.
    shown = {name: value for name, value in facts.items() if name not in ("written", "cautions")}
    show_facts(title, {name.replace("_", " "): _words(value) for name, value in shown.items()})
    for path in [written] if isinstance(written, str) else written:
        say(f"wrote {path}")


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name}: {number}" for name, number in value.items())
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _plain(value: Any) -> Any:
    """Turn what JSON does not know into what it does."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _number(value: float) -> float | None:
    return None if value != value else round(value, 2)
