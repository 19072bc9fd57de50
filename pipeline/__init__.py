"""Orchestration: load, segment, trace, simulate, compare, report."""

import os

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS")


def one_thread() -> None:
    """Limit every library that is imported from now on to one thread.

    ``-j`` alone decides how many cores are used, and a sum computed by two threads differs in its last digit from one
    computed by a single thread.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))
