"""``pliant mend``: the repairs that ``pliant inspect`` names."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .field import AsJson, MeshFile
from .output import MeshOutput, named, report_findings, say, say_json, show_facts

if TYPE_CHECKING:
    from ..mesh import Mesh, Repair


def mend(
    mesh: MeshFile,
    out: MeshOutput,
    merge: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="DISTANCE",
            help="First join vertices within a distance of each other, in the mesh's unit; 0 joins equal ones.",
        ),
    ] = None,
    largest: Annotated[bool, typer.Option("--largest", help="Keep only the component of most area.")] = False,
    index_map: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            callback=named(".npz"),
            help="Also write what became of vertices and faces: .npz with index_map, faces_kept, faces_flipped.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Drop degenerate and doubled faces and vertices without a face, wind faces alike, and write the mesh.

    Per-vertex values that the file holds are not written. Holes and non-manifold places stay.
    """
    from .. import check_up, load_mesh, repaired, save_arrays, save_mesh

    surface = load_mesh(mesh)
    repair = repaired(surface, tolerance=merge, largest=largest)
    save_mesh(out, repair.mesh)
    if index_map is not None:
        names = ("index_map", "faces_kept", "faces_flipped")
        save_arrays(index_map, {name: getattr(repair, name) for name in names})
    left = check_up(repair.mesh)
    report_findings(out.name, left.findings)
    written = [str(path) for path in (out, index_map) if path is not None]
    done = _done(surface, repair)
    if as_json:
        say_json({"mesh": str(mesh), **done, "check_up": left.to_dict(), "written": written})
        return
    show_facts(f"{mesh.name}, mended", {name.replace("_", " "): str(count) for name, count in done.items()})
    for path in written:
        say(f"wrote {path}")


def _done(old: Mesh, repair: Repair) -> dict[str, Any]:
    gone = int((repair.index_map < 0).sum())
    return {
        "vertices": repair.mesh.n_vertices,
        "faces": repair.mesh.n_faces,
        "vertices_dropped": gone,
        "vertices_joined": old.n_vertices - gone - repair.mesh.n_vertices,
        "faces_dropped": old.n_faces - repair.mesh.n_faces,
        "faces_turned": int(repair.faces_flipped.size),
    }
