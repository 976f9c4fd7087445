"""Untrusted XML: element by element, without DTD, entities or external references, and bounded.

A file is never held as one tree: what was not asked for is dropped as soon as it ends.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import read_bytes

MAX_XML: Final = 250_000_000
"""bytes; Xsens writes 7 kB a frame, and a run at 240 Hz has thirty thousand."""
_LONG_TAG: Final = re.compile(rb"<[^<>]{100000}")
_DEEPEST: Final = 64
"""Elements within each other; formats of tracks and captures nest less than ten."""
_MOST: Final = 2_000_000
"""Elements in a file: half a million track points, or an hour and more of frames."""


def elements(path: Path, names: Collection[str], heads: Collection[str] = ()) -> Iterator[Element]:
    """The whole elements of the given local names, in the order in which they end, outermost only; those named in
    ``heads`` when they begin, with nothing but their attributes.

    An element is good until the next one is asked for.  Raises InputError for broken XML, a DTD, entities, unknown
    encodings, and nesting or numbers beyond any capture's.
    """
    data = read_bytes(path, MAX_XML)
    if _LONG_TAG.search(data):
        raise InputError(path, "", "a tag longer than any recording has", "export the run alone")
    depth, count, within = 0, 0, 0
    ancestors: list[Element] = []
    try:
        for event, element in iterparse(io.BytesIO(data), events=("start", "end"), forbid_dtd=True):
            wanted = local_name(element) in names
            if event == "start":
                depth, count, within = depth + 1, count + 1, within + wanted
                ancestors.append(element)
                if depth > _DEEPEST or count > _MOST:
                    raise InputError(path, "", "more elements than any recording has", "export the run alone")
                if local_name(element) in heads:
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
