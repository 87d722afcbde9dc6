"""Make mutants of one file of the firmware and let its own native suites judge each.

universalmutator alters the source line by line. A mutant counts when it compiles and its object
differs from the original's and from every other mutant's (-O2, no debug information): what the
compiler finds the same cannot be detected by any test. A header's object is that of its suites'
files that include it, at -O0, for optimising them takes four times as long; only what lives is
compared at -O2 too. A mutant is killed when a test case fails, the suite crashes or runs for twenty
times its processor time, 0.3 s at least. What survives so is compared with the original's
object at other levels of optimisation, and as clang makes it: where one is equal, the program is
the same. The rest is built once more under address and undefined-behaviour sanitizers, as
`pio test -e native` does. What lives then and has a proof in `proofs.toml` is the same program too.
"""

from __future__ import annotations

import difflib
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from threading import Lock

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
SUITES = ROOT / "tests" / "firmware"
OUT = ROOT / "build" / "mutants"
PROOFS = Path(__file__).resolve().parent / "proofs.toml"

CLANG = "clang++"  # what fuzzing has; without it more survives
COMPILER = os.environ.get("CXX", "g++")
PLAIN = (
    "-std=gnu++14",
    "-O2",
    "-g0",
    "-w",
    "-fPIC",
    "-Ifirmware",
    "-Iprotocol",
    "-Itests/firmware",
)
SANITIZED = (
    *("-std=gnu++14", "-O1", "-g1", "-w", "-fPIC", "-Ifirmware", "-Iprotocol", "-Itests/firmware"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
)
MAIN = ("-std=gnu++14", "-O0", "-g0", "-w", "-Itests/firmware")  # doctest's own code: 2 s, not 16
OTHER_LEVELS = ("-Os", "-O1", "-O3")  # a header is compared at the first alone
LEAST_CPU_S, MOST_TIMES = 0.3, 20  # one mutant in six never ends
LIBRARY = "libmutant.so"
# What the rules make of names of types (uint0_t, uint(8+1)_t): never compiles.
_BROKEN_TYPE = re.compile(r"\bu?int(-?[01]|\(\d+[+-]1\))_t|\bu?int\d+_t\(")

# test_attitude holds these products against 64 bits: their factors may change places.
_SWAPPED = re.compile(r"\b(mul_q30|mul_high) \( ([^(),]+),([^(),]+)\)")
INVALID, SAME, KILLED, SURVIVED = "invalid", "same", "killed", "survived"


class MutantError(Exception):
    """The unchanged file does not pass its suite, or a tool is missing."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One changed source: the line it changed, as it was and as it is."""

    text: str
    line: int
    was: str
    now: str

    @property
    def key(self) -> str:
        """Name of the mutant in the notes."""
        return sha256(self.text.encode()).hexdigest()[:20]


def mutants_of(source: Path) -> list[Mutant]:
    """Let universalmutator alter a file; what can never compile is left out at once."""
    program = Path(sys.executable).with_name("mutate")
    if not program.is_file():
        raise MutantError(f"no {program}: run make setup")
    original = source.read_text(encoding="utf-8")
    found: dict[str, Mutant] = {}
    with tempfile.TemporaryDirectory() as folder:
        command = [str(program), str(source), "cpp", "--noCheck", "--mutantDir", folder]
        subprocess.run(command, capture_output=True, check=True, cwd=folder)
        made = Path(folder).glob(f"{source.stem}.mutant.*{source.suffix}")
        for path in sorted(made, key=_number):
            text = path.read_text(encoding="utf-8")
            mutant = _compare(original, text)
            if mutant is not None and not _BROKEN_TYPE.search(mutant.now):
                found.setdefault(mutant.key, mutant)
    # In an order that says nothing, so that the first hundred stand for all.
    return sorted(found.values(), key=lambda mutant: mutant.key)


def _number(path: Path) -> int:
    return int(path.name.split(".")[-2])


def _compare(original: str, text: str) -> Mutant | None:
    old, new = original.splitlines(), text.splitlines()
    for tag, i1, i2, j1, j2 in difflib.SequenceMatcher(None, old, new, False).get_opcodes():
        if tag != "equal":
            was, now = " ".join(old[i1:i2]), " ".join(line.strip() for line in new[j1:j2])
            return Mutant(text, i1 + 1, was.strip(), now.strip())
    return None


class Judge:
    """The suites of one file, compiled once, and the verdict on each of its mutants.

    Parameters
    ----------
    name : str
        Name of the file in firmware, with its folder: ``core/drive.cpp``, ``drivers/sd_card.h``.
    suites : tuple of str
        Its suites in tests/firmware.
    folder : Path
        For objects and programs.
    shared : Path, optional
        For objects that other files' suites link too.

    Raises
    ------
    MutantError
        If the unchanged file does not pass.
    """

    def __init__(
        self, name: str, suites: tuple[str, ...], folder: Path, shared: Path | None = None
    ) -> None:
        self.source = FIRMWARE / name
        self._name, self._suites, self._folder = name, suites, folder
        self._shared = shared or folder / "shared"
        self._of_suites = [p for s in suites for p in sorted((SUITES / s).glob("*.cpp"))]
        self._programs: dict[tuple[str, ...], list[Path]] = {}
        self._limits_s: dict[tuple[str, ...], float] = {}
        # What tells mutants apart first, and what judges them.
        self._plain = _plain_at("-O0") if self._is_header else PLAIN
        self._including = self._files_that_include() if self._is_header else []
        self._headers = _headers()
        self._sanitizing = Lock()
        self._originals: dict[tuple[str, ...], str] = {}
        self._by_clang: bytes | None = None
        self._prepare(self._plain)

    def _prepare(self, flags: tuple[str, ...]) -> None:
        """Build the suites of the unchanged file and see that they pass."""
        kind = "sanitized" if flags is SANITIZED else "plain"
        text = self.source.read_text(encoding="utf-8")
        shared = SANITIZED if flags is SANITIZED else PLAIN
        objects = [self._object(path, shared) for path in self._others()]
        objects.append(self._object(SUITES / "check_main.cpp", MAIN))
        if self._is_header:
            self._compile_ahead(flags)
        original = self._folder / kind
        original.mkdir()
        built = self._built(text, original, flags)
        if not built or not self._link(built, original, flags):
            raise MutantError(f"{self._name} does not link")
        if self._is_header:
            programs = [self._program("all", objects, original, flags, kind)]
        else:
            programs = [
                self._program(suite, [*self._cases(suite, flags), *objects], original, flags, kind)
                for suite in self._suites
            ]
        self._programs[flags] = programs
        self._limits_s[flags] = 60.0
        before_s = _children_s()
        if not self._passes(original, flags):
            raise MutantError(f"{self._name}: its own suite fails without a mutation")
        self._limits_s[flags] = max(LEAST_CPU_S, MOST_TIMES * (_children_s() - before_s))

    @property
    def _is_header(self) -> bool:
        return self.source.suffix == ".h"

    def _files_that_include(self) -> list[Path]:
        """Return the files of the suites that a change of the header reaches."""
        found = [path for path in self._of_suites if self.source in includes(path)]
        if not found:
            raise MutantError(f"{self._name}: none of {', '.join(self._suites)} includes it")
        return found

    def _others(self) -> list[Path]:
        """Return what the suites link besides the mutant, in an order of its own."""
        core = FIRMWARE / "core"
        others = set(core.rglob("*.cpp"))
        for path in self._of_suites:
            # A suite of the IMU's program needs all of its room.
            used = (one for one in includes(path) if FIRMWARE in one.parents)
            rooms = {one.parent for one in used if one.with_suffix(".cpp").is_file()}
            others.update(one for room in rooms for one in room.glob("*.cpp"))
            if self._is_header and path not in self._including:
                others.add(path)
        return sorted(others - {self.source})

    def verdict(self, mutant: Mutant, seen: dict[str, str]) -> str:
        """Judge a mutant; `seen` holds the objects known so far, by their content."""
        with tempfile.TemporaryDirectory(dir=self._folder) as name:
            folder = Path(name)
            built = self._built(mutant.text, folder, self._plain)
            if not built:
                return INVALID
            content = self._content(built)
            if content == self._original(self._plain) or _is_known(seen, content, mutant):
                return SAME
            if not self._link(built, folder, self._plain) or not self._passes(folder, self._plain):
                return KILLED
            if self._is_same_otherwise(mutant, folder, seen):
                return SAME
            with self._sanitizing:
                if SANITIZED not in self._programs:
                    self._prepare(SANITIZED)
            built = self._built(mutant.text, folder, SANITIZED)
            if not built:
                return INVALID
            if not (self._link(built, folder, SANITIZED) and self._passes(folder, SANITIZED)):
                return KILLED
            return SURVIVED

    def _is_same_otherwise(self, mutant: Mutant, folder: Path, seen: dict[str, str]) -> bool:
        if _SWAPPED.search(mutant.now) and _SWAPPED.sub(r"\1(\3, \2)", mutant.now) == mutant.was:
            return True
        if self._is_header:
            content = self._content_of(mutant.text, folder, PLAIN)
            if content == self._original(PLAIN) or _is_known(seen, content, mutant):
                return True
        for level in OTHER_LEVELS[:1] if self._is_header else OTHER_LEVELS:
            flags = _plain_at(level)
            if self._content_of(mutant.text, folder, flags) == self._original(flags):
                return True
        if self._is_header or shutil.which(CLANG) is None:
            return False
        if self._by_clang is None:
            self._by_clang = _clang_object(self.source.read_text(encoding="utf-8"))
        return _clang_object(mutant.text) == self._by_clang

    def _original(self, flags: tuple[str, ...]) -> str:
        if flags not in self._originals:
            with tempfile.TemporaryDirectory(dir=self._folder) as name:
                text = self.source.read_text(encoding="utf-8")
                self._originals[flags] = self._content_of(text, Path(name), flags)
        return self._originals[flags]

    def _content_of(self, text: str, folder: Path, flags: tuple[str, ...]) -> str:
        return self._content(self._built(text, folder, flags))

    def _built(self, text: str, folder: Path, flags: tuple[str, ...]) -> list[Path]:
        """Compile what a text of the file decides; nothing where it does not compile."""
        # The same names for all: they must not tell the objects apart.
        place = folder / "changed" / self._name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
        if not self._is_header:
            target = folder / "mutant.o"
            return [target] if self._compile(place, target, flags) else []
        kind = "sanitized" if flags is SANITIZED else "plain"
        ahead = (f"-I{folder / 'changed'}", *flags)
        if flags in (self._plain, SANITIZED):
            ahead = (f"-I{self._folder / f'ahead-{kind}'}", "-include", "check.h", *ahead)
        built = []
        for path in self._including:
            target = folder / f"{path.parent.name}-{path.stem}.o"
            if not self._compile(path, target, ahead):
                return []
            built.append(target)
        return built

    def _compile_ahead(self, flags: tuple[str, ...]) -> None:
        """Compile doctest's header once: it is most of what a suite takes."""
        ahead = self._folder / f"ahead-{'sanitized' if flags is SANITIZED else 'plain'}"
        ahead.mkdir()
        header = ahead / "check.h"
        header.write_bytes((SUITES / "check.h").read_bytes())
        command = [COMPILER, *flags, "-x", "c++-header", str(header), "-o", f"{header}.gch"]
        subprocess.run(command, cwd=ROOT, capture_output=True, check=True)

    def _cases(self, suite: str, flags: tuple[str, ...]) -> list[Path]:
        return [self._object(path, flags) for path in sorted((SUITES / suite).glob("*.cpp"))]

    def _object(self, path: Path, flags: tuple[str, ...]) -> Path:
        """Compile what no mutant alters, once for all files of the table."""
        state = sha256("\0".join((COMPILER, path.parent.name, path.name, *flags)).encode())
        beside = b"".join(other.read_bytes() for other in sorted(path.parent.glob("*.h")))
        state.update(path.read_bytes() + self._headers + beside)
        target = self._shared / f"{state.hexdigest()[:20]}.o"
        if not target.is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            part = target.with_suffix(f".{os.getpid()}")
            if not self._compile(path, part, flags):
                raise MutantError(f"{path} does not compile")
            part.replace(target)
        return target

    @staticmethod
    def _compile(source: Path, target: Path, flags: tuple[str, ...]) -> bool:
        command = [COMPILER, *flags, "-c", str(source), "-o", str(target)]
        return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0

    # A mutant is a library of its own next to programs that stay: linking those takes ten times as
    # long as compiling it.
    @staticmethod
    def _link(built: list[Path], folder: Path, flags: tuple[str, ...]) -> bool:
        extra = [flag for flag in flags if "sanitize" in flag]
        library = folder / LIBRARY
        # What a header defines is the mutant's, whatever the program has of it.
        command = [COMPILER, *extra, "-shared", "-Wl,-Bsymbolic", *map(str, built), "-o"]
        command.append(str(library))
        return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0

    def _program(
        self, suite: str, objects: list[Path], library: Path, flags: tuple[str, ...], kind: str
    ) -> Path:
        program = self._folder / f"{kind}-{suite}"
        extra = [flag for flag in flags if "sanitize" in flag]
        command = [COMPILER, *extra, "-rdynamic", "-Wl,--no-as-needed", *map(str, objects)]
        command += [f"-L{library}", "-lmutant", "-o", str(program)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise MutantError(f"{suite} does not link: {done.stderr[-500:]}")
        return program

    def _passes(self, library: Path, flags: tuple[str, ...]) -> bool:
        # A name that is missing shows at the start, not at its first call.
        variables = {**os.environ, "LD_LIBRARY_PATH": str(library), "LD_BIND_NOW": "1"}
        limit_s = self._limits_s[flags]
        for program in self._programs[flags]:
            try:
                # The suites' main() tells failures in words, for PlatformIO, and ends with 0.
                done = subprocess.run(
                    [str(program)], capture_output=True, text=True, errors="replace", check=False,
                    preexec_fn=lambda: _limit(limit_s), timeout=600, env=variables,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                return False
            if done.returncode != 0 or "SUCCESS!" not in done.stdout:
                return False
        return True

    @staticmethod
    def _content(built: list[Path]) -> str:
        return sha256(b"".join(path.read_bytes() for path in built)).hexdigest()


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _limit(most_s: float) -> None:
    # It outlasts exec, and unlike RLIMIT_CPU it knows parts of a second.
    signal.setitimer(signal.ITIMER_PROF, most_s)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def includes(path: Path) -> set[Path]:
    """Return what of the firmware a file includes, by whatever way."""
    command = [COMPILER, *PLAIN, "-MM", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    words = (ROOT / word for word in done.stdout.split()[1:])
    return {word.resolve() for word in words if word.is_file()}


def _clang_object(text: str) -> bytes:
    # From a pipe: an object of clang's holds the name of its source.
    command = [CLANG, *PLAIN, "-x", "c++", "-c", "-", "-o", "-"]
    return subprocess.run(
        command, cwd=ROOT, input=text.encode(), capture_output=True, check=True
    ).stdout


def _plain_at(level: str) -> tuple[str, ...]:
    return tuple(level if flag == "-O2" else flag for flag in PLAIN)


def _is_known(seen: dict[str, str], content: str, mutant: Mutant) -> bool:
    return seen.setdefault(content, mutant.key) != mutant.key


def _headers() -> bytes:
    """Return what any object may be made of besides its own folder."""
    places = (FIRMWARE, ROOT / "protocol" / "generated")
    found = [path for place in places for path in sorted(place.rglob("*.h"))]
    return b"".join(path.read_bytes() for path in [*found, *sorted(SUITES.glob("*.h"))])


@dataclass(frozen=True, slots=True)
class Result:
    """What came of the mutants of a file."""

    name: str
    verdicts: dict[str, str]
    survivors: list[Mutant]  # without a proof
    made: int
    proved: int = 0

    @property
    def judged(self) -> str:
        """How many of those that were made."""
        all_of_them = len(self.verdicts) == self.made
        return "all" if all_of_them else f"{len(self.verdicts)} of {self.made}"

    def count(self, verdict: str) -> int:
        """How many ended so."""
        return sum(1 for one in self.verdicts.values() if one == verdict)

    @property
    def share(self) -> float:
        """Killed of those that count."""
        return self.count(KILLED) / self.counted if self.counted else 0.0

    @property
    def counted(self) -> int:
        """Mutants that are another program, as far as is known."""
        return self.count(KILLED) + len(self.survivors)


def judge_file(
    name: str, suites: tuple[str, ...], *, jobs: int, most: int | None = None, out: Path = OUT
) -> Result:
    """Judge every mutant of a file, going on where an earlier run of the same file stopped.

    A survivor is judged again when a suite has changed; what was killed stays so while the file
    is the same, as long as suites only grow (remove build/mutants to begin anew). `most` bounds how
    many are judged: a sample that says nothing of which.
    """
    out.mkdir(parents=True, exist_ok=True)
    source = FIRMWARE / name
    used = sorted(includes(source))
    of_file = sha256(b"".join(path.read_bytes() for path in [source, *used])).hexdigest()
    texts = b"".join(p.read_bytes() for s in suites for p in sorted((SUITES / s).glob("*")))
    of_suites = sha256(texts).hexdigest()
    notes = out / f"{name.replace('/', '-')}.json"
    kept = json.loads(notes.read_text()) if notes.is_file() else {}
    verdicts: dict[str, str] = kept.get("verdicts", {}) if kept.get("file") == of_file else {}
    seen: dict[str, str] = kept.get("seen", {}) if verdicts else {}
    if kept.get("suites") != of_suites:
        verdicts = {key: one for key, one in verdicts.items() if one != SURVIVED}
    made = mutants_of(source)
    mutants = made[:most]
    waiting = [mutant for mutant in mutants if mutant.key not in verdicts]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        if waiting:
            judge = Judge(name, suites, Path(folder), out / "objects")
            pairs = zip(waiting, pool.map(lambda m: judge.verdict(m, seen), waiting), strict=True)
            for at, (mutant, one) in enumerate(pairs):
                verdicts[mutant.key] = one
                if at % 20 == 19 or at + 1 == len(waiting):
                    notes.write_text(
                        json.dumps({"file": of_file, "suites": of_suites,
                                    "verdicts": verdicts, "seen": seen})
                    )  # fmt: skip
                    _progress(name, at + 1, len(waiting))
    known = {mutant.key: verdicts[mutant.key] for mutant in mutants}
    proofs = proofs_of(name)
    for stale in proofs - {(one.line, one.was, one.now) for one in made}:
        raise MutantError(f"{name}: a proof in {PROOFS.name} is of no mutant: {stale}")
    survived = [one for one in mutants if known[one.key] == SURVIVED]
    left = [one for one in survived if (one.line, one.was, one.now) not in proofs]
    return Result(name, known, left, len(made), len(survived) - len(left))


def proofs_of(name: str) -> set[tuple[int, str, str]]:
    """Return line, text before and text after of the mutants of a file that are proved the same."""
    rows = tomllib.loads(PROOFS.read_text(encoding="utf-8"))["proof"]
    return {
        (row["line"], row["was"], now) for row in rows if row["file"] == name for now in row["now"]
    }


def _progress(name: str, done: int, whole: int) -> None:
    if sys.stderr.isatty() or done == whole or done % 500 == 0:
        print(f"{name}: {done} of {whole}", file=sys.stderr, flush=True)


def survivor_lines(result: Result) -> Iterator[str]:
    """Name each survivor: line, as it was, as it is."""
    for mutant in result.survivors:
        yield f"  {result.name}:{mutant.line}  {mutant.was}  =>  {mutant.now}"
