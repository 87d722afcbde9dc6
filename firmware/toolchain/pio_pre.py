"""Before a PlatformIO build: board there? compiler, settings, sanitizers of `native`.

PlatformIO runs this ahead of the platform's own build script.
"""

import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from SCons.Script import COMMAND_LINE_TARGETS, DefaultEnvironment
from serial.tools import list_ports

env = DefaultEnvironment()
SANITIZERS = [
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
    "-fno-omit-frame-pointer",
]


def sanitizers_work(compiler: str) -> bool:
    """Compile and run a program with the sanitizers; the answer is kept per compiler."""
    path = shutil.which(compiler)
    if path is None:
        return False
    stamp = f"{path} {Path(path).resolve().stat().st_mtime_ns}"
    memory = Path(env.subst("$BUILD_DIR")) / "sanitizers.txt"
    if memory.is_file():
        known, _, answer = memory.read_text().partition("\n")
        if known == stamp:
            return answer == "yes"
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "probe.cpp"
        source.write_text("int main() { return 0; }\n")
        program = Path(folder) / "probe"
        built = subprocess.run(
            [path, *SANITIZERS, str(source), "-o", str(program)], capture_output=True, check=False
        )
        works = built.returncode == 0
        if works:
            works = subprocess.run([program], capture_output=True, check=False).returncode == 0
    memory.parent.mkdir(parents=True, exist_ok=True)
    memory.write_text(f"{stamp}\n{'yes' if works else 'no'}")
    return works


def without_sanitizers(build_env: Any, node: Any) -> Any:
    """Compile doctest's own code plainly: 2 s; with sanitizers and -O1 it takes 16 s."""
    flags = [f for f in build_env["CCFLAGS"] if f not in SANITIZERS and not str(f).startswith("-O")]
    return build_env.Object(node, CCFLAGS=[*flags, "-O0"])


sys.path.insert(0, env.subst("$PROJECT_DIR/firmware/toolchain"))

if "upload" in COMMAND_LINE_TARGETS and not env.subst("$UPLOAD_PORT"):
    upload_port = importlib.import_module("upload_port")
    absent = upload_port.complaint(port.vid for port in list_ports.comports())
    if absent:
        sys.stderr.write(f"{absent}\n")
        env.Exit(1)

compilers = importlib.import_module("compilers")
try:
    chosen_compiler = compilers.folder(os.environ.get(compilers.CHOICE, ""))
except compilers.CompilerError as error:
    sys.stderr.write(f"{error}\n")
    env.Exit(1)
if chosen_compiler is not None and env["PIOPLATFORM"] == "atmelavr":
    env.PrependENVPath("PATH", str(chosen_compiler))

if env["PIOENV"] == "mega2560":
    settings_check = importlib.import_module("settings_check")
    wrong = settings_check.complaint(
        Path(env.subst("$PROJECT_DIR/firmware")), python=env.subst("$PYTHONEXE")
    )
    if wrong:
        sys.stderr.write(f"{wrong}\n")
        env.Exit(1)

if env["PIOENV"] == "native":
    if sanitizers_work(env.subst("$CXX")):
        env.Append(CCFLAGS=SANITIZERS, LINKFLAGS=SANITIZERS)
        env.AddBuildMiddleware(without_sanitizers, "*check_main.cpp")
    elif os.environ.get("CI"):
        sys.stderr.write(
            f"{env.subst('$CXX')} has no address and undefined sanitizers; CI needs them\n"
        )
        env.Exit(1)
    else:
        print(f"{env.subst('$CXX')} has no sanitizers: tests run without them")
