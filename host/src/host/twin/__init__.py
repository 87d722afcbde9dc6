"""The digital twin: pilot, aircraft, air and sensors around the logger.

Nothing in here is imported by `host --help`; the compiled kernels need the extra ``compiled``.
"""
