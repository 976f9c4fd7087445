"""``sssi``, also as ``python -m sssi_exudyn``."""

from typing import NoReturn

from sssi_exudyn.runtime.interrupts import end_on_interrupt
from sssi_exudyn.runtime.process_memory import prepare_memory
from sssi_exudyn.runtime.threads import use_one_thread_for_products


def start() -> NoReturn:
    """Run ``sssi`` and end the process with its exit status."""
    use_one_thread_for_products()
    prepare_memory()
    with end_on_interrupt():
        from sssi_exudyn.cli import main
    main()


if __name__ == "__main__":
    start()
