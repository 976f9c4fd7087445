"""Reports with empty plots, for tests of all else that a page holds: drawing its plots takes two seconds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def without_plots() -> Iterator[None]:
    """Leave the plots of reports empty."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sssi_exudyn.reports.plots.svg", lambda *_: "<svg></svg>")
        yield
