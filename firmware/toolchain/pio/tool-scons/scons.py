"""PlatformIO starts SCons by this path; PyPI's package of the same version does the work."""

import SCons.Script

SCons.Script.main()
