"""Untrusted XML: element by element, without DTD, entities or external references, and bounded.

A file is never held as one tree: what was not asked for is dropped as soon as it ends.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_ELEMENTS, MAX_MARKUP, MAX_NESTING, MAX_XML
from sssi_exudyn.io.files import open_regular


class _Guarded:
    """A stream that the parser reads, held against the bounds of length.

    The parser reads what has not ended yet (a tag, comment or instruction) anew with every piece that it gets.  So the
    bound on that keeps its work proportional to the file.
    """

    def __init__(self, path: Path, stream: BinaryIO, limit: int) -> None:
        self.path, self.stream, self.limit = path, stream, limit
        self.given = self.seen = 0

    def mark_element(self) -> None:
        """An element began or ended."""
        self.seen = self.given

    def read(self, size: int = -1, /) -> bytes:
        """The next ``size`` bytes.  Raises InputError beyond the bounds."""
        if self.given - self.seen > MAX_MARKUP:
            problem = "a tag, comment or text longer than any recording has"
            raise InputError(self.path, "", problem, "export the run alone")
        if self.given > self.limit:
            problem = f"the file has more than {self.limit / 1e6:.0f} MB"
            raise InputError(self.path, "", problem, "export the run alone")
        piece = self.stream.read(size)
        self.given += len(piece)
        return piece


def elements(
    path: Path, names: Collection[str], heads: Collection[str] = (), limit: int = MAX_XML
) -> Iterator[Element]:
    """The whole elements of the given local names, in the order in which they end, outermost only; those named in
    ``heads`` when they begin, with nothing but their attributes.

    An element is good until the next one is asked for.  Raises InputError for broken XML, a DTD, entities, unknown
    encodings, and nesting or numbers beyond any capture's.
    """
    depth, count, within = 0, 0, 0
    ancestors: list[Element] = []
    try:
        with open_regular(path) as stream:
            guarded = _Guarded(path, stream, limit)
            for event, element in iterparse(guarded, ("start", "end"), forbid_dtd=True):
                guarded.mark_element()
                name = local_name(element)
                wanted = name in names
                if event == "start":
                    depth, within = depth + 1, within + wanted
                    count += 1 + len(element.attrib)
                    ancestors.append(element)
                    if depth > MAX_NESTING or count > MAX_ELEMENTS:
                        raise InputError(path, "", "more elements than any recording has", "export the run alone")
                    if name in heads:
                        yield element
                    continue
                depth, within = depth - 1, within - wanted
                ancestors.pop()
                if within == 0:
                    if wanted:
                        yield element
                    element.clear()
                    if ancestors:
                        ancestors[-1].remove(element)
    except ParseError as error:
        if count == 0 and not path.stat().st_size:
            raise InputError(path, "", "the file is empty", "export it again") from None
        raise InputError(path, f"line {error.position[0]}", "broken XML", "export the file again") from None
    except DefusedXmlException:
        raise InputError(path, "", "a DTD or entities are not accepted", "export the file without them") from None
    except (LookupError, ValueError):  # an unknown encoding
        raise InputError(path, "", "the encoding cannot be read", "save the file as UTF-8") from None


def local_name(element: Element) -> str:
    """A tag's name without its namespace."""
    return str(element.tag).rsplit("}", 1)[-1]


def text_below(element: Element, name: str) -> str | None:
    """The text of the first descendant of that local name, wherever extensions put it."""
    for below in element.iter():
        if local_name(below) == name and below.text:
            return below.text.strip()
    return None
