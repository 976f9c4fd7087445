"""Threads of matrix products."""

import os
import subprocess
import sys

import pytest

from sssi_exudyn.runtime.threads import LINEAR_ALGEBRA, use_one_thread_for_products


def test_products_take_one_thread_unless_the_environment_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    stated, *others = LINEAR_ALGEBRA
    monkeypatch.setattr(os, "environ", {stated: "3"})
    use_one_thread_for_products()
    assert os.environ == {stated: "3"} | dict.fromkeys(others, "1")


def test_the_command_says_so_before_numpy_is_imported() -> None:
    """A library reads its variables once, as it is loaded."""
    code = "import sys, sssi_exudyn.__main__; sys.exit('numpy' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
