"""Threads of matrix products."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from sssi_exudyn.runtime.threads import (
    LINEAR_ALGEBRA,
    both,
    cores_used,
    one_ahead,
    use_one_thread_for_products,
    with_one_thread_for_products,
)


def test_products_take_one_thread_unless_the_environment_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    stated, *others = LINEAR_ALGEBRA
    monkeypatch.setattr(os, "environ", {stated: "3"})
    monkeypatch.setitem(sys.modules, "numpy", np)
    use_one_thread_for_products()
    assert os.environ == {stated: "3"}  # in a session that has NumPy it would come too late
    monkeypatch.delitem(sys.modules, "numpy")
    use_one_thread_for_products()
    assert os.environ == {stated: "3"} | dict.fromkeys(others, "1")


def test_the_command_says_so_before_numpy_is_imported() -> None:
    """A library reads its variables once, as it is loaded."""
    code = "import sys, sssi_exudyn.__main__; sys.exit('numpy' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_function_s_products_take_one_thread_in_a_session_that_has_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Afterwards, and where the environment says otherwise, they take as many as before."""

    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    monkeypatch.setattr(os, "environ", {})
    with threadpool_limits(2, user_api="blas"):
        assert set(with_one_thread_for_products(threads)()) == {1}
        assert set(threads()) == {2}
        os.environ[LINEAR_ALGEBRA[0]] = "2"
        assert set(with_one_thread_for_products(threads)()) == {2}


def test_one_result_is_computed_ahead_of_its_use_and_no_more() -> None:
    """Results come in order; when one is used, the next may have begun, and the one after it has not."""
    begun: list[int] = []

    def double(item: int) -> int:
        begun.append(item)
        return 2 * item

    for item, result in enumerate(one_ahead(double, range(5))):
        assert result == 2 * item
        assert len(begun) <= item + 2
    assert begun == list(range(5))
    assert not list(one_ahead(double, []))


def test_cores_are_those_that_the_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3, 7, 9}, raising=False)
    assert cores_used() == 3
    assert cores_used(2) == 2
    monkeypatch.delattr(os, "sched_getaffinity")  # as on macOS and Windows
    assert cores_used() == 64


def test_both_functions_run_at_a_time_and_an_error_of_either_is_raised() -> None:
    meeting = threading.Barrier(2, timeout=30.0)  # where one would wait for the other's end, it breaks

    def meet(text: str) -> str:
        meeting.wait()
        return text

    assert both(lambda: meet("first"), lambda: meet("second")) == ("first", "second")
    with pytest.raises(ZeroDivisionError):
        both(lambda: 1 / 0, lambda: 1)
    with pytest.raises(ZeroDivisionError):
        both(lambda: 1, lambda: 1 / 0)
