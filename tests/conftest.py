"""No test depends on time, on chance, or on how it was started.

Hypothesis draws the same cases, at any speed, every run. A shell that starts a job in the
background lets it ignore Ctrl-C, and so its children: those that are to end by Ctrl-C would hang.
"""

import signal

from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True, database=None)
settings.load_profile("house")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
