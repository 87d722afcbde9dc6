"""The digital twin: pilot, aircraft, air and sensors that the logger flies in.

Nothing in here is imported by `host --help`; the compiled kernels need the extra ``compiled``.
"""
