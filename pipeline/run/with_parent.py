"""Imported first by the server that workers are forked from: the operating system ends it as soon as its parent ended.

It would notice that by itself, but only once it has imported all the rest, seconds later on a busy machine.
"""

import ctypes
import signal

PR_SET_PDEATHSIG = 1
"""Of Linux; elsewhere there is no such call, and the server notices later."""

if hasattr(_system := ctypes.CDLL(None), "prctl"):
    _system.prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
