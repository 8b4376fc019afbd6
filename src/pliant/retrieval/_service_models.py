"""What the service answers, as its OpenAPI description says it."""

from __future__ import annotations

from pydantic import BaseModel, Field


class Problem(BaseModel):
    """Why a request was refused."""

    error: str = Field(description="What is wrong, and what to do about it.")


class LabelCount(BaseModel):
    """One class of the index."""

    label: str
    items: int


class About(BaseModel):
    """What is served, and within which limits."""

    version: str = Field(description="Version of Pliant.")
    items: int
    bits: int = Field(description="Length of the codes, the greatest distance there can be.")
    exact: bool = Field(description="Whether a search compares with every code.")
    labels: list[LabelCount] = Field(description="Classes in alphabetic order.")
    upload_bytes: int = Field(description="Largest request.")
    pixels: int = Field(description="Largest picture.")
    matches: int = Field(description="Most matches in a reply.")


class ItemReply(BaseModel):
    """One picture of the index."""

    id: int
    name: str
    label: str = Field(description="Its class; empty where it has none.")


class MatchReply(ItemReply):
    """One match."""

    distance: int = Field(description="Bits in which the codes differ.")


class QueryReply(BaseModel):
    """The nearest pictures, by distance and then by id."""

    matches: list[MatchReply]
    bits: int
    label: str = Field(description="Most frequent class among the matches; of equals, the one met first.")
    width: int = Field(description="Of the query, turned upright, in pixels.")
    height: int
    notes: list[str] = Field(
        description="What was done to the query (turned, reduced, fill left out), and whether matches tie."
    )
    preview: str = Field(description="The query as it was understood: a small JPEG as a data URL.")
    seconds: float = Field(description="Processor time of the answer.")


class SharedReply(BaseModel):
    """What the query and one picture of the index share. Places are shares of width and height, 0 to 1."""

    points: list[tuple[float, float, float, float]] = Field(
        description="x, y in the query and x, y in the other, nearest features first."
    )
    query_box: tuple[float, float, float, float] | None = Field(
        description="x0, y0, x1, y1 of the shared part."
    )
    item_box: tuple[float, float, float, float] | None
    score: float = Field(
        description="Matches that agree with one transform, times the correlation of the edges under it."
    )
    reason: str = Field(description="Why nothing, or little, was found.")
