"""Untrusted XML, read element by element within bounds, without DTD, entities or external references.

A file is never held as one tree: an element that was not requested is dropped as soon as it ends.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO, Final
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_ELEMENTS, MAX_MARKUP, MAX_NESTING, MAX_XML
from sssi_exudyn.io.files import open_regular

_BLANKS: Final = re.compile(rb"\A(?:\xef\xbb\xbf|[ \t\r\n])+")
"""Blanks and the byte order mark that a UTF-8 text begins with."""
_TORN: Final = (3, 5)
"""Expat's codes of a file that ends too early: no element found, unclosed token (pyexpat.errors)."""


class TornMarkup(InputError):
    """An XML file that ends before its elements do, as of a device that stopped; what came before is whole."""


class _Guarded:
    """The stream that the parser reads, with bounds on its length.

    The parser reads an unfinished tag, comment or instruction again with every piece that it gets.  The bound on its
    length keeps the parser's work proportional to the file.
    """

    def __init__(self, path: Path, stream: BinaryIO, limit: int) -> None:
        self.path, self.stream, self.limit = path, stream, limit
        self.given = self.seen = 0

    def mark_element(self) -> None:
        """Note that an element began or ended."""
        self.seen = self.given

    def read(self, size: int = -1, /) -> bytes:
        """Read the next ``size`` bytes, without blanks before the first of them.  Raises InputError beyond the bounds.

        A site's export may begin with blanks or empty lines, which the parser does not take before ``<?xml``.
        """
        if self.given - self.seen > MAX_MARKUP:
            problem = "a tag, comment or text longer than any recording has"
            raise InputError(self.path, "", problem, "export the run alone")
        if self.given > self.limit:
            problem = f"the file has more than {self.limit / 1e6:.0f} MB"
            raise InputError(self.path, "", problem, "export the run alone")
        piece = self.stream.read(size)
        if self.given == 0:
            piece = _BLANKS.sub(b"", piece, count=1)
        self.given += len(piece)
        return piece


def elements(
    path: Path, names: Collection[str], heads: Collection[str] = (), limit: int = MAX_XML
) -> Iterator[Element]:
    """Yield elements of an XML file by their local names.

    Elements named in ``names`` come whole, outermost only, in the order in which they end.  Elements named in ``heads``
    come when they begin, with nothing but their attributes.  An element is valid until the next one is requested.

    Raises TornMarkup for a file that ends too early.  Raises InputError for other broken XML, a DTD, entities, unknown
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
                requested = name in names
                if event == "start":
                    depth, within = depth + 1, within + requested
                    count += 1 + len(element.attrib)
                    ancestors.append(element)
                    if depth > MAX_NESTING or count > MAX_ELEMENTS:
                        raise InputError(path, "", "more elements than any recording has", "export the run alone")
                    if name in heads:
                        yield element
                    continue
                depth, within = depth - 1, within - requested
                ancestors.pop()
                if within == 0:
                    if requested:
                        yield element
                    element.clear()
                    if ancestors:
                        ancestors[-1].remove(element)
    except ParseError as error:
        if count == 0 and not path.stat().st_size:
            raise InputError(path, "", "the file is empty", "export it again") from None
        kind = TornMarkup if error.code in _TORN else InputError
        raise kind(path, f"line {error.position[0]}", "broken XML", "export the file again") from None
    except DefusedXmlException:
        raise InputError(path, "", "a DTD or entities are not accepted", "export the file without them") from None
    except (LookupError, ValueError):  # an unknown encoding
        raise InputError(path, "", "the encoding cannot be read", "save the file as UTF-8") from None


def local_name(element: Element) -> str:
    """Return a tag's name without its namespace."""
    return str(element.tag).rsplit("}", 1)[-1]


def text_below(element: Element, name: str) -> str | None:
    """Return the text of the first descendant of that local name, wherever extensions put it."""
    for descendant in element.iter():
        if local_name(descendant) == name and descendant.text:
            return descendant.text.strip()
    return None
