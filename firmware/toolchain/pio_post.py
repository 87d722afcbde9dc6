"""After PlatformIO's program is described: the archives it links.

FatFs is compiled without our warnings. For the test environments our own code
is an archive too, so that a suite of `core` needs no stand-in for hal functions
that only `app` calls.
"""

from typing import Any

from SCons.Script import DefaultEnvironment, Import

Import("projenv")
env = DefaultEnvironment()
projenv: Any = globals()["projenv"]
archives = []

archive_filter = env.GetProjectOption("custom_archive_filter", "")
if archive_filter:
    archives.append(
        projenv.BuildLibrary("$BUILD_DIR/firmware_archive", "$PROJECT_SRC_DIR", archive_filter)
    )
if env["PIOENV"] != "arduimu":
    archives.append(
        env.BuildLibrary("$BUILD_DIR/fatfs_archive", "$PROJECT_DIR/build/fatfs-0.1.2", "+<ff.c>")
    )

env.Append(LIBS=archives)
