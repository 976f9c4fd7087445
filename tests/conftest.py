"""Before any test: is this checkout whole?"""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "sssi_exudyn"


def pytest_configure() -> None:
    """Stop with one line where the package's links to the model folders are missing or no links."""
    broken = [name for name in ("bodies", "contact", "fitting", "validation") if not (PACKAGE / name).is_dir()]
    if broken:
        raise pytest.UsageError(
            f"sssi_exudyn/{', sssi_exudyn/'.join(broken)}: a symbolic link to the folder of that name is missing; "
            "check out again with: git config core.symlinks true && git checkout -- sssi_exudyn"
        )
