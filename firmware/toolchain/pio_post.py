"""After PlatformIO's program is described: compiler, archives, strictness, hash, RAM.

For the test environments our own code is an archive, so that a suite of `core`
needs no stand-in for hal functions that only `app` calls.
"""

import importlib
import os
import sys
from pathlib import Path
from typing import Any

from SCons.Script import DefaultEnvironment, Import

Import("projenv")
env = DefaultEnvironment()
projenv: Any = globals()["projenv"]
root = Path(env.subst("$PROJECT_DIR"))
# pio_pre.py has put this folder on the path; SCons takes it off before it builds.
ram_table = importlib.import_module("ram_table")
stack_depth = importlib.import_module("stack_depth")
disassembly = importlib.import_module("disassembly")
naked = importlib.import_module("naked")

compilers = importlib.import_module("compilers")
image_hash = importlib.import_module("image_hash")

# Asked of the compiler that is at work, not of the name of its package.
if env["PIOPLATFORM"] == "atmelavr":
    try:
        wrong = compilers.complaint(
            compilers.version(env.subst("$CC"), env["ENV"]), os.environ.get(compilers.CHOICE, "")
        )
    except compilers.CompilerError as error:
        wrong = str(error)
    if wrong:
        sys.stderr.write(f"{wrong}\n")
        env.Exit(1)

# A warning that PlatformIO's own build of a compiler gives and ours does not must not keep a user
# from building.
if os.environ.get("CI") or (root / "platformio.local.ini").is_file():
    projenv.Append(CCFLAGS=["-Werror"])

archives = []
archive_filter = env.GetProjectOption("custom_archive_filter", "")
if archive_filter:
    archives.append(
        projenv.BuildLibrary("$BUILD_DIR/firmware_archive", "$PROJECT_SRC_DIR", archive_filter)
    )
env.Append(LIBS=archives)


def show_ram(target: Any, source: Any, env: Any) -> int:
    """Print the table of RAM after linking; a stack that is too small fails the build."""
    elf = Path(str(target[0]))
    enough = ram_table.print_table(
        elf,
        ram_bytes=int(env.BoardConfig().get("upload.maximum_ram_size")),
        stack_bytes=int(env.GetProjectOption("custom_stack_bytes")),
        environment=env["ENV"],
    )
    return 0 if show_stack(elf, env) and naked_as_written(elf, env) and enough else 1


def naked_as_written(elf: Path, env: Any) -> bool:
    """Print what is wrong with the interrupts in assembly; False if anything is."""
    wrong = naked.complaints(
        disassembly.Program(elf, environment=env["ENV"]), env.BoardConfig().get("build.mcu")
    )
    for line in wrong:
        print(line)
    return not wrong


def show_stack(elf: Path, env: Any) -> bool:
    """Print the deepest stack; False if it does not fit."""
    where = {"chip": env.BoardConfig().get("build.mcu"), "environment": env["ENV"]}
    try:
        deepest = stack_depth.analyse(elf, **where).total_bytes
        room = stack_depth.room_bytes(elf, **where)
    except stack_depth.ImageError as error:
        # CI refuses such an image; a compiler never seen here must not keep a user from building.
        print(f"the deepest stack is not known: {error}")
        return True
    print(f"{deepest:>7} B  of them the stack takes at most")
    if deepest > room:
        print(f"found a stack of up to {deepest} B, expected at most {room} B")
    return bool(deepest <= room)


def stamp(target: Any, source: Any, env: Any) -> int:
    """Write the image's hash into it, before the .hex is made of it."""
    try:
        value = image_hash.stamp(Path(str(target[0])), environment=env["ENV"])
    except image_hash.ImageError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    print(f"image {value:08x}")
    return 0


if env.GetProjectOption("custom_stack_bytes", ""):
    env.AddPostAction("$PROGPATH", env.VerboseAction(stamp, "Hash of $TARGET"))
    env.AddPostAction("$PROGPATH", env.VerboseAction(show_ram, "RAM of $TARGET"))
