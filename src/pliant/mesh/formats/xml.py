"""XML as a small tree: no entities, no network, bounded depth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from ...errors import FileFormatError

_DEPTH = 64


@dataclass(eq=False)
class Node:
    """One element."""

    tag: str
    attributes: dict[str, str]
    children: list[Node] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Character data of this element alone."""
        return "".join(self.pieces)

    def named(self, tag: str) -> Iterator[Node]:
        """Children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Node | None:
        """First child with a tag, if any."""
        return next(self.named(tag), None)


def parsed(data: bytes) -> Node:
    """Parse a document; one that declares entities is refused."""
    open_nodes = [Node("", {})]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_nodes) > _DEPTH:
            message = f"XML nested deeper than {_DEPTH} elements"
            raise FileFormatError(message)
        node = Node(tag, attributes)
        open_nodes[-1].children.append(node)
        open_nodes.append(node)

    def end(_: str) -> None:
        open_nodes.pop()

    def characters(piece: str) -> None:
        open_nodes[-1].pieces.append(piece)

    def entity(*_: object) -> None:
        raise FileFormatError("the XML declares entities, which mesh files have no use for; it is not read")

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.buffer_size = 1 << 20
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        message = f"the XML is broken or truncated: {error}"
        raise FileFormatError(message) from error
    return open_nodes[0].children[0]
