"""Orchestration: load, segment, trace, simulate, compare, report."""

import os

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS")


def one_thread() -> None:
    """Let no library that is imported from here on take threads of its own.

    ``-j`` is the one budget of cores, and a sum by two threads differs from that by one in its last digit.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))
