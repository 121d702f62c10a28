"""The program: one verb a file; parse, call, print, exit code.  No thinking here."""
