"""The program: one verb a file; parse, call, print, exit code.  No thinking here."""

import os

# Before numpy is there: the matrices here have ten rows, and threads of the linear algebra only get in each other's way.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
