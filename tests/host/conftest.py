"""One thread of linear algebra per process, before numpy is loaded.

The matrices here are small: on a busy machine threads that spin for them make a fit ten times
slower.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
