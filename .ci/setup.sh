#!/usr/bin/env bash
# Put everything the project needs into .venv, .cache and build of this clone.
#   setup.sh        all that `make test` needs
#   setup.sh demo   only Python packages and a C++ compiler
#   setup.sh hw     KiCad and CAD for `make hw`, in .venv-hw; nothing else asks for them
# May be run again: what is there already is left alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

purpose="${1:-test}"
[ "$purpose" != hw ] || exec .ci/setup_hw.sh
logs=build/logs
mkdir -p "$logs"

say() { printf 'setup: %s\n' "$*"; }
stop() {
  printf 'setup: %s\n' "$*" >&2
  exit 1
}

# Run a command with its output in a log; on failure show the end of it.
quietly() {
  local log="$logs/$1"
  shift
  if ! "$@" >"$log" 2>&1 </dev/null; then
    tail -n 15 "$log" >&2
    stop "failed: $* (all of it: $log)"
  fi
}

# One line each why: compiler and Python of the PC; compiler, library and uploader of the Mega;
# unit tests; coverage-guided fuzzing; the chip simulator and the board's bootloader for it; looking into card images as a PC would;
# looking at pages as a user's browser would.
packages=(git make python3 python3-venv g++
  gcc-avr avr-libc avrdude
  doctest-dev
  clang libclang-rt-dev
  simavr libsimavr-dev arduino-core-avr
  dosfstools mtools
  chromium)

missing_packages() {
  local package
  for package in "${packages[@]}"; do
    dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null |
      grep -qx installed || printf '%s ' "$package"
  done
}

install_packages() {
  local missing as_root=()
  missing="$(missing_packages)"
  [ -n "$missing" ] || return 0
  say "Debian packages missing: $missing"
  printf '  apt-get install --no-install-recommends %s\n' "$missing"
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || stop "run the line above as root, then make again"
    if [ -n "${CI:-}" ]; then
      as_root=(sudo --non-interactive)
    elif [ -t 0 ]; then
      local answer
      read -r -p 'setup: run it now with sudo? [y/N] ' answer
      [[ "$answer" == [yY]* ]] || stop "run the line above, then make again"
      sudo --validate || stop "sudo refused; run the line above as root, then make again"
      as_root=(sudo)
    else
      stop "run the line above as root, then make again"
    fi
  fi
  export DEBIAN_FRONTEND=noninteractive
  # Another apt may hold the lock: wait for it.
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive
    apt-get --yes -o DPkg::Lock::Timeout=300 -o APT::Update::Error-Mode=any)
  say "installing them"
  quietly apt-update.log "${apt[@]}" update
  # shellcheck disable=SC2086
  quietly apt-install.log "${apt[@]}" install --no-install-recommends $missing
}

require_tools() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || stop "no $tool found: install it and make again"
  done
}

python_ready() { python3 -c 'import ensurepip, venv' 2>/dev/null; }

if [ "$purpose" = demo ] && python_ready && command -v "${CXX:-c++}" >/dev/null; then
  : # nothing to ask the distribution for
elif command -v dpkg-query >/dev/null && command -v apt-get >/dev/null; then
  [ "$purpose" != demo ] || packages=(python3 python3-venv g++)
  install_packages
elif [ "$purpose" = demo ]; then
  require_tools python3 c++
else
  say "no apt here; expecting what Debian calls ${packages[*]}"
  require_tools python3 c++ avr-g++ avrdude
fi

python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
  stop "found $(python3 --version), expected Python 3.11 or newer"

# --- Python packages -------------------------------------------------------------------------

# A clone that was moved, or a Python that was upgraded, leaves a .venv of dead paths.
venv_works() {
  .venv/bin/python -c 'import pip' 2>/dev/null && grep -qsF "$PWD/.venv/bin" .venv/bin/pip
}
if ! venv_works; then
  say "making .venv"
  quietly venv.log python3 -m venv --clear .venv
fi
python=.venv/bin/python

requirements=(-r .ci/requirements.txt)
[ "$purpose" != demo ] || requirements=(-r .ci/requirements-demo.txt)
inputs="$(cat .ci/requirements*.txt .ci/constraints.txt host/pyproject.toml | sha256sum | cut -c1-64)"
if ! grep -qsx -e "test $inputs" -e "$purpose $inputs" .venv/setup-done; then
  say "installing Python packages into .venv (about a minute)"
  extras="$("$python" -c 'import tomllib, pathlib
project = tomllib.loads(pathlib.Path("host/pyproject.toml").read_text())["project"]
extras = project.get("optional-dependencies", {})
print(",".join(sorted(extras.keys() - {"simulate"})))')"  # a compiler of 100 MB, where the clone has one
  quietly pip.log "$python" -m pip install --disable-pip-version-check --progress-bar off \
    --constraint .ci/constraints.txt "${requirements[@]}" --editable "host[$extras]"
  # The build takes uPlot from npm; without npm its files come with a package, whose Python nobody runs.
  [ -s build/uplot/uPlot.iife.js ] || quietly pip-uplot.log "$python" -m pip install \
    --disable-pip-version-check --progress-bar off --constraint .ci/constraints.txt --no-deps uplot-python
  [ "$purpose" = demo ] || quietly pip-programs.log "$python" -m pip install \
    --disable-pip-version-check --progress-bar off --no-deps -r .ci/requirements-programs.txt
  printf '%s %s\n' "$purpose" "$inputs" >>.venv/setup-done
fi

# --- compiled kernels ------------------------------------------------------------------------

inputs="$({ find host/src/host/compiled.py host/src/host/aircraft host/src/host/twin host/src/host/sysid \
  host/src/host/thesis -name '*.py' |
  sort | xargs cat
  .venv/bin/pip --version; pwd; } | sha256sum | cut -c1-64)"
if ! grep -qsx "$inputs" .cache/kernels-done; then
  say "compiling the kernels of virtual flight and identification (half a minute)"
  quietly kernels.log "$python" -m host.twin
  quietly kernels-sysid.log "$python" -m host.sysid
  quietly kernels-thesis.log "$python" -m host.thesis
  mkdir -p .cache
  printf '%s\n' "$inputs" >.cache/kernels-done
fi

# --- PlatformIO ------------------------------------------------------------------------------

if [ "$purpose" != demo ]; then
  inputs="$({ find firmware/toolchain/pio* -type f -not -name '*.pyc' | sort | xargs cat
    cat .ci/requirements.txt; pwd; } | sha256sum | cut -c1-64)"
  if ! grep -qsx "$inputs" .cache/pio-done; then
    say "asking PlatformIO's registry (at most 5 s)"
    "$python" firmware/toolchain/pio_core.py
    mkdir -p .cache
    printf '%s\n' "$inputs" >.cache/pio-done
  fi
fi
if [ "$purpose" != demo ]; then
  say "done; next: make demo, make test"
fi
