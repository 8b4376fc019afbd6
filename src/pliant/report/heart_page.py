"""One self-contained page about one ventricle: pictures, numbers, every step's settings, and what it is not."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..heart.patient import HeartDescription
from ..heart.segment_names import SEGMENT_NAMES
from ..heart.segments import TERRITORIES
from ..mesh import principal_curvatures
from .heart import bulls_eye_figure, contour_figure, segment_figure
from .page import surface_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["heart_page"]

DISCLAIMER = (
    "Research software, not a medical device: not for diagnosis or treatment. Nothing here has been validated on "
    "patients with known stenosis."
)
_NOTES = (
    "The endocardium of the left ventricle in RAS millimetres; the settings of every step are at the end."
)
_STYLE = """
.disclaimer { border: 1px solid var(--wrong); border-left-width: 6px; border-radius: 6px; padding: 10px 14px; }
.disclaimer { margin: 0 0 16px; }
.cautions { border-left: 6px solid #ffb000; padding: 6px 14px; margin: 0 0 16px; background: var(--wash); }
.cautions ul { margin: 4px 0; padding-left: 20px; }
.eyes { display: flex; flex-wrap: wrap; gap: 16px; }
.eyes figure { flex: 1 1 300px; max-width: 420px; }
.below figure { margin: 0; }
.below figure img { display: block; max-width: 100%; height: auto; }
"""


def heart_page(
    description: HeartDescription, *, title: str, settings: Mapping[str, object] | None = None
) -> str:
    """Write a page about one ventricle, as HTML that loads nothing from anywhere.

    Parameters
    ----------
    description : HeartDescription
        From :func:`pliant.heart.describe_heart`.
    title : str
        Heading and window title.
    settings : mapping, optional
        Further rows of the table of settings, as the file's name and the version.

    Returns
    -------
    str
        A surface to turn, with curvedness, shape index and segments; bull's-eyes of segments and roughness; the
        contour over the image where there is one; a table of segments; the settings of every step. It says that it is
        research software and not a medical device.

    Notes
    -----
    About 3 MB and 4 s.

    Examples
    --------
    >>> from pliant.heart import describe_heart, heart_phantom
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=2.5, rng=1)
    >>> found = describe_heart(phantom.mesh, landmarks=phantom.landmarks, points=40)
    >>> "not a medical device" in heart_page(found, title="A phantom")
    True
    """
    bend = principal_curvatures(
        description.mesh, radius=float(description.features.settings.get("radius", 3.0))
    )
    labels = np.where(description.labels > 0, description.labels, np.nan).astype(np.float64)
    layers = {
        "curvedness (1/mm)": bend.curvedness,
        "shape index": bend.shape_index,
        "AHA segment": labels,
        "territory": _territories(description),
    }
    rows: dict[str, object] = dict(settings or {})
    rows |= {
        f"{step}: {name}": value for step, found in description.steps.items() for name, value in found.items()
    }
    html = surface_page(
        description.mesh,
        layers,
        title=title,
        notes=_NOTES,
        settings=rows,
        colour_map="cividis",
        length_unit="mm",
        label_names={"territory": dict(enumerate(TERRITORIES, start=1))},
    )
    html = html.replace("</style>", _STYLE + "</style>", 1)
    html = html.replace("<main>", _banner(description.cautions) + "<main>", 1)
    return html.replace('<div class="below">', '<div class="below">' + _sections(description), 1)


def _territories(description: HeartDescription) -> np.ndarray[Any, Any]:
    number = np.full(18, np.nan)
    for i, segments in enumerate(TERRITORIES.values()):
        number[list(segments)] = i + 1
    return number[description.labels]


def _banner(cautions: Sequence[str]) -> str:
    banner = f'<p class="disclaimer" role="note"><strong>{escape(DISCLAIMER)}</strong></p>'
    if cautions:
        items = "".join(f"<li>{escape(text)}</li>" for text in cautions)
        banner += (
            f'<div class="cautions" role="note"><strong>Look at this first</strong><ul>{items}</ul></div>'
        )
    return banner


def _sections(description: HeartDescription) -> str:
    features, frame = description.features, description.frame
    numbers = bulls_eye_figure(title="Segments")
    rough = bulls_eye_figure(features.roughness[1:], title="Roughness", label="mean curvedness (1/mm)")
    eyes = _image(numbers, "Bull's-eye: numbers of the segments in the colours of the three territories")
    eyes += _image(rough, "Bull's-eye: mean curvedness of each segment, in 1/mm")
    parts = [_section("Bull's-eye", f'<div class="eyes">{eyes}</div>')]
    if description.volume is not None:
        contour = contour_figure(description.volume, description.mesh, frame)
        parts.append(
            _section("Contour over the image", _image(contour, "Slices with the outline of the surface"))
        )
    walls = segment_figure(description.mesh, description.labels, frame)
    parts.append(_section("Segments", _image(walls, "The surface from four sides, coloured by segment")))
    parts.append(_section("Numbers", _table(description)))
    return "".join(parts)


def _section(heading: str, body: str) -> str:
    return f"<section><h2>{escape(heading)}</h2>{body}</section>"


def _image(figure: Figure, caption: str) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    return f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{data}"></figure>'


def _table(description: HeartDescription) -> str:
    features = description.features
    of = {s: name for name, segments in TERRITORIES.items() for s in segments}
    cavity = (
        "not known: the surface is open" if np.isnan(features.cavity_ml) else f"{features.cavity_ml:.1f} ml"
    )
    head = "".join(
        f'<th scope="col">{name}</th>' for name in ("Segment", "Territory", "Area (mm²)", "Roughness (1/mm)")
    )
    rows = "".join(
        f'<tr><th scope="row">{s} {escape(SEGMENT_NAMES[s - 1])}</th><td>{of[s]}</td>'
        f"<td>{features.areas[s]:.0f}</td><td>{features.roughness[s]:.3f}</td></tr>"
        for s in range(1, 18)
    )
    axis, mean = description.frame.length, features.roughness[0]
    ball = "" if np.isnan(features.sphericity) else f"; sphericity {features.sphericity:.2f}"
    whole = f"<p>Cavity {cavity}; long axis {axis:.1f} mm{ball}; mean roughness {mean:.3f} per mm.</p>"
    table = f'<table class="numbers"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    return (
        f'{whole}<div class="wide" tabindex="0" role="region" aria-label="Numbers of segments">{table}</div>'
    )
