"""The application behind the search page. Imports FastAPI: only to be imported where a service is wanted."""

# Without postponed annotations: FastAPI reads them, and those of a closure can only be read at once.
import base64
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib import resources
from typing import Annotated, Any, BinaryIO

import numpy as np
from fastapi import FastAPI, File, Form, Path, Query, Request, UploadFile
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException

from .._parallel import job_count
from ..errors import PliantError
from ..images import PairMatch, Picture, decode_picture, match_pair
from ._service_guard import HEADERS, Guard
from ._service_models import About, ItemReply, LabelCount, MatchReply, Problem, QueryReply, SharedReply
from ._service_work import ClientGoneError, TooBusyError, Workers
from .index import ShapeIndex
from .querying import preview_jpeg, query_index
from .service import ServiceLimits

_ASSETS = {
    "search.css": "text/css",
    "search.js": "text/javascript",
    "shared.js": "text/javascript",
    "describe.js": "text/javascript",
    "icon.svg": "image/svg+xml",
}
# The greatest whole number that the catalogue can hold.
_GREATEST_ID = 2**63 - 1
ItemId = Annotated[int, Path(ge=1, le=_GREATEST_ID)]
Upload = Annotated[UploadFile, File(description="JPEG, PNG, WebP, TIFF, GIF, BMP or PNM.")]
_REFUSALS: dict[int | str, dict[str, Any]] = {
    401: {"model": Problem, "description": "The token is missing or wrong."},
    403: {
        "model": Problem,
        "description": "Asked by another site, or under a name that is not this machine's.",
    },
    422: {"model": Problem, "description": "An argument is out of range, or the picture cannot be used."},
}
_UPLOAD_REFUSALS = _REFUSALS | {
    400: {"model": Problem, "description": "The request cannot be read."},
    408: {"model": Problem, "description": "The request took too long to arrive."},
    409: {"model": Problem, "description": "The index is empty."},
    413: {"model": Problem, "description": "The request is too large."},
    429: {"model": Problem, "description": "Too many requests wait; come again."},
}


def application(index: ShapeIndex, token: str | None, loopback: bool, limits: ServiceLimits) -> FastAPI:
    """Make the application; see :func:`pliant.retrieval.create_app`."""
    from .. import __version__

    workers = Workers(job_count(limits.workers), limits.waiting)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        workers.close()

    app = FastAPI(
        title="Pliant retrieval",
        version=__version__,
        summary="Find the pictures of an index that look like another one.",
        docs_url=None,  # FastAPI's own page loads its script from elsewhere.
        redoc_url=None,
        lifespan=lifespan,
    )
    app.add_middleware(
        Guard, token=token, loopback=loopback, upload_bytes=limits.upload_bytes, patience=limits.patience
    )
    _explain_errors(app)
    _add_pages(app)
    _add_catalogue(app, index, limits)
    _add_queries(app, index, workers, limits)
    return app


def _add_pages(app: FastAPI) -> None:
    folder = resources.files(__package__) / "assets"
    files = {name: (folder / name).read_bytes() for name in _ASSETS}
    pages = {name: (folder / f"{name}.html").read_bytes() for name in ("search", "describe")}

    @app.get("/", include_in_schema=False)
    def search_page() -> Response:
        return Response(pages["search"], media_type="text/html; charset=utf-8")

    @app.get("/docs", include_in_schema=False)
    def description() -> Response:
        return Response(pages["describe"], media_type="text/html; charset=utf-8")

    @app.get("/assets/{name}", include_in_schema=False)
    def asset(name: str) -> Response:
        if name not in files:
            raise HTTPException(404, "there is no such file")
        return Response(files[name], media_type=_ASSETS[name], headers={"Cache-Control": "no-cache"})


def _add_catalogue(app: FastAPI, index: ShapeIndex, limits: ServiceLimits) -> None:
    from .. import __version__

    @app.get("/api/index", responses=_REFUSALS, summary="What is served")
    def about() -> About:
        labels = [LabelCount(label=label, items=count) for label, count in index.labels().items()]
        return About(
            version=__version__,
            items=len(index),
            bits=index.bits,
            exact=index.exact,
            labels=labels,
            upload_bytes=limits.upload_bytes,
            pixels=limits.pixels,
            matches=limits.matches,
        )

    @app.get("/api/sample", responses=_REFUSALS, summary="Some pictures of the index, evenly spread")
    def sample(count: Annotated[int, Query(ge=1, le=limits.matches)] = 12) -> list[ItemReply]:
        return [ItemReply(id=i.id, name=i.name, label=i.label) for i in index.sample(count)]

    not_found = {404: {"model": Problem, "description": "There is no such picture."}}

    @app.get(
        "/api/items/{item}/preview",
        response_class=Response,
        responses=_REFUSALS
        | not_found
        | {200: {"content": {"image/jpeg": {}}, "description": "A small JPEG."}},
        summary="A small JPEG of a picture of the index",
    )
    def preview(item: ItemId) -> Response:
        jpeg = index.preview(item)
        if jpeg is None:
            raise HTTPException(404, f"item {item} is not in the index, or has no preview")
        # Ids are never used again, so that this stays true.
        keep = {"Cache-Control": "private, max-age=86400, immutable"}
        return Response(jpeg, media_type="image/jpeg", headers=keep)


def _add_queries(app: FastAPI, index: ShapeIndex, workers: Workers, limits: ServiceLimits) -> None:
    def picture_of(file: BinaryIO) -> Picture:
        return decode_picture(file.read(), name="the picture", max_pixels=limits.pixels)

    def nearest(file: BinaryIO, count: int, label: str | None) -> QueryReply:
        start = time.thread_time()
        result = query_index(index, picture_of(file), count=count, label=label or None)
        picture = result.picture
        return QueryReply(
            matches=[MatchReply(**vars(match)) for match in result.matches],
            bits=result.bits,
            label=result.label,
            width=picture.size[0],
            height=picture.size[1],
            notes=list(result.notes),
            preview="data:image/jpeg;base64," + base64.b64encode(preview_jpeg(picture)).decode("ascii"),
            seconds=round(time.thread_time() - start, 4),
        )

    def shared(file: BinaryIO, item: int) -> SharedReply:
        jpeg = index.preview(item)
        if jpeg is None:
            raise HTTPException(404, f"item {item} is not in the index, or has no preview")
        pictures = picture_of(file), decode_picture(jpeg, name=f"item {item}")
        return _as_shares(match_pair(*pictures), *pictures)

    @app.post("/api/query", responses=_UPLOAD_REFUSALS, summary="The pictures most like one that is sent")
    async def query(
        request: Request,
        image: Upload,
        count: Annotated[int, Form(ge=1, le=limits.matches, description="Matches wanted.")] = 12,
        label: Annotated[str | None, Form(max_length=1000, description="Only among this class.")] = None,
    ) -> QueryReply:
        if not len(index):
            index.refresh()
        if not len(index):
            raise HTTPException(409, "the index is empty: add pictures with 'pliant retrieval add'")
        return await workers.run(request.is_disconnected, nearest, image.file, count, label)

    @app.post(
        "/api/shared",
        responses=_UPLOAD_REFUSALS | {404: {"model": Problem, "description": "There is no such picture."}},
        summary="What a picture that is sent and one of the index share",
    )
    async def shared_features(
        request: Request,
        image: Upload,
        item: Annotated[int, Form(ge=1, le=_GREATEST_ID, description="Id of the other.")],
    ) -> SharedReply:
        return await workers.run(request.is_disconnected, shared, image.file, item)


def _as_shares(match: PairMatch, query: Picture, other: Picture) -> SharedReply:
    sizes = np.array([query.size, other.size], dtype=np.float64)
    points = np.hstack([(match.points1 + 0.5) / sizes[0], (match.points2 + 0.5) / sizes[1]]).round(5)
    boxes = [
        tuple((box / np.tile(size, 2)).round(5).tolist()) if box.any() else None
        for box, size in zip((match.box1, match.box2), sizes, strict=True)
    ]
    return SharedReply(
        points=points.tolist(),
        query_box=boxes[0],
        item_box=boxes[1],
        score=match.score,
        reason=match.reason,
    )


def _explain_errors(app: FastAPI) -> None:
    """Answer every refusal in one form: a status and {"error": what is wrong}."""

    @app.exception_handler(HTTPException)
    async def refused(_: Request, error: HTTPException) -> JSONResponse:
        return JSONResponse({"error": str(error.detail)}, error.status_code, dict(error.headers or {}))

    @app.exception_handler(RequestValidationError)
    async def out_of_range(_: Request, error: RequestValidationError) -> JSONResponse:
        problems = (f"{_place(one['loc'])}: {one['msg']}" for one in error.errors())
        return JSONResponse({"error": "; ".join(problems)}, 422)

    @app.exception_handler(PliantError)
    async def unusable(_: Request, error: PliantError) -> JSONResponse:
        return JSONResponse({"error": str(error)}, 422)

    @app.exception_handler(TooBusyError)
    async def busy(_: Request, __: TooBusyError) -> JSONResponse:
        return JSONResponse({"error": "too many requests wait; try again soon"}, 429, {"Retry-After": "2"})

    @app.exception_handler(ClientGoneError)
    async def unheard(_: Request, __: ClientGoneError) -> JSONResponse:
        return JSONResponse({"error": "the client went away"}, 408)

    @app.exception_handler(Exception)
    async def failed(_: Request, __: Exception) -> JSONResponse:
        # Outside of the guard, which adds the headers to every other answer.
        return JSONResponse({"error": "the service failed; its log says why"}, 500, HEADERS)


def _place(location: Any) -> str:
    return ".".join(str(part) for part in location[1:]) or "the request"
