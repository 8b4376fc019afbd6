"""``pliant demo``: the geodesic field of a real cortical hemisphere, from an installed package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .files import write_figure
from .measure import BINS, NEIGHBOURS, Measurement, contexts, measure
from .output import output_folder, report_findings, say, show_facts

if TYPE_CHECKING:
    from .._arrays import FloatArray

Folder = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="DIR", callback=output_folder, help="Folder for the figures and the page."
    ),
]


def demo(folder: Folder = Path("pliant-demo")) -> None:
    """Show the geodesic field of a cortical hemisphere: a table, figures and an interactive page.

    The mesh is fsaverage5, which the nilearn package ships: no network is needed.
    """
    from .. import check_up, gch_edges, shapes
    from ..datasets import fsaverage5

    folder.mkdir(parents=True, exist_ok=True)
    # Compiling on first use is no part of the times shown.
    measure(shapes.icosphere(3), "warm-up", length_unit="mm")
    fields = {}
    for surface in ("pial", "white"):
        mesh = fsaverage5(surface)
        report_findings(surface, check_up(mesh).findings)
        fields[surface] = measure(mesh, f"fsaverage5, left {surface} surface", length_unit="mm")
    edges = gch_edges(*(result.values for result in fields.values()), bins=BINS)
    histograms = {name: contexts(result, edges) for name, result in fields.items()}
    distance = _distance(histograms["pial"], histograms["white"])
    fields["pial"].show()
    _compare(fields, distance)
    for path in _draw(folder, fields, histograms, edges, distance):
        say(f"wrote {path}")


def _distance(first: FloatArray, second: FloatArray) -> FloatArray:
    """Relative L2 distance of histograms, as the dissertation compares them (section 2.3.2)."""
    import numpy as np

    change: FloatArray = np.linalg.norm(first - second, axis=1) / np.linalg.norm(first, axis=1)
    return change


def _compare(fields: dict[str, Measurement], distance: FloatArray) -> None:
    import numpy as np

    pial, white = fields["pial"], fields["white"]
    correlation = np.corrcoef(pial.values, white.values)[0, 1]
    facts = {
        "time, pial and white": f"{pial.seconds:.2f} s, {white.seconds:.2f} s",
        "correlation of their fields": f"{correlation:.3f}",
        "relative GCH distance, median": f"{np.median(distance):.3f}",
        "relative GCH distance, 95 %": f"{np.quantile(distance, 0.95):.3f}",
    }
    show_facts("Pial against white surface", facts)


def _draw(
    folder: Path,
    fields: dict[str, Measurement],
    histograms: dict[str, FloatArray],
    edges: FloatArray,
    distance: FloatArray,
) -> list[Path]:
    from ..report import hemisphere_views, histogram_figure, surface_figure, surface_page, write_page

    pial, white = fields["pial"], fields["white"]
    picture = folder / "gfe.png"
    drawn = surface_figure(
        pial.mesh,
        pial.values,
        views=hemisphere_views("left"),
        title="Geodesic field estimate, fsaverage5, left pial surface",
        colour_bar_label=pial.label,
        scale="log",
        length_unit="mm",
    )
    write_figure(picture, drawn)
    spread = folder / "gfe-distribution.png"
    series = {name: result.values for name, result in fields.items()}
    drawn = histogram_figure(series, title="Geodesic field estimate, fsaverage5", label=pial.label)
    write_figure(spread, drawn)
    html = surface_page(
        pial.mesh,
        {
            f"{pial.label}, pial": pial.values,
            f"{white.label}, white": white.values,
            "GCH distance, pial to white": distance,
        },
        title="Geodesic field of a cortical hemisphere",
        length_unit="mm",
        histograms={f"GCH, {name} ({NEIGHBOURS} nearest vertices)": h for name, h in histograms.items()},
        edges=edges,
        notes=f"{pial.meaning} FreeSurfer's average brain (fsaverage5), left hemisphere, drawn on the pial surface.",
        settings={
            **pial.settings,
            "neighbours": f"{NEIGHBOURS} nearest vertices along edges",
            "bins": f"{BINS} of equal width up to the 98th percentile of both fields; the rest in the last",
        },
    )
    return [picture, spread, write_page(folder / "gfe.html", html)]
