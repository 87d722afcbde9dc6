#!/usr/bin/env bash
# What `make hw` needs and nothing else does: KiCad 9 from Debian's backports, CAD in .venv-hw.
# Called by `setup.sh hw`. Asks before it adds the source; may be run again.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

logs=build/logs
mkdir -p "$logs"
source_list=/etc/apt/sources.list.d/bookworm-backports.sources
# Without KiCad's 3D models: they are 5 GB, our own solids stand in. graphviz draws the harness.
packages=(kicad kicad-symbols kicad-footprints)
plain=(graphviz librsvg2-bin)

say() { printf 'setup hw: %s\n' "$*"; }
stop() {
  printf 'setup hw: %s\n' "$*" >&2
  exit 1
}
quietly() {
  local log="$logs/$1"
  shift
  if ! "$@" >"$log" 2>&1 </dev/null; then
    tail -n 15 "$log" >&2
    stop "failed: $* (all of it: $log)"
  fi
}

kicad_ready() {
  [[ "$(kicad-cli version 2>/dev/null)" == 9.* ]] && [ -d /usr/share/kicad/footprints ] &&
    /usr/bin/python3 -c 'import pcbnew' 2>/dev/null
}
pictures_ready() { command -v dot >/dev/null && command -v rsvg-convert >/dev/null; }

install_packages() {
  command -v apt-get >/dev/null ||
    stop "no apt here: install KiCad 9 with its symbols and footprints, graphviz, rsvg-convert"
  # The backports come on top of what this system takes Debian from already.
  local archive source
  archive="$(apt-get indextargets --format '$(RELEASE) $(COMPONENT) $(SITE)' 'Created-By: Packages' |
    sed -n 's/^bookworm main //p' | head -n 1)"
  [ -n "$archive" ] || stop "no Debian 12 among apt's sources (apt-get update first?): install KiCad 9 by hand, then make hw"
  printf -v source 'Types: deb\nURIs: %s\nSuites: bookworm-backports\nComponents: main\nSigned-By: /usr/share/keyrings/debian-archive-keyring.gpg' "$archive"
  say "KiCad 9 comes from Debian's backports (120 MB to fetch, 870 MB on disk). To do by hand, $source_list with"
  printf '%s\n' "$source" | sed 's/^/    /'
  printf '  apt-get update && apt-get install --no-install-recommends -t bookworm-backports %s\n' "${packages[*]}"
  printf '  apt-get install --no-install-recommends %s\n' "${plain[*]}"
  if [ -z "${CI:-}" ]; then
    [ -t 0 ] || stop "nobody to ask: run the lines above, or set CI=1 to agree"
    local answer
    read -r -p 'setup hw: add that source to this system and install? [y/N] ' answer
    [[ "$answer" == [yY]* ]] || stop "run the lines above, then make hw again"
  fi
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || stop "run the lines above as root, then make hw again"
    as_root=(sudo)
    [ -z "${CI:-}" ] || as_root=(sudo --non-interactive)
  fi
  # Backports have priority 100: nothing else of the system comes from there by itself.
  printf '%s\n' "$source" | "${as_root[@]}" tee "$source_list" >/dev/null
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive
    apt-get --yes -o DPkg::Lock::Timeout=300)
  say "installing"
  quietly hw-apt-update.log "${apt[@]}" update
  quietly hw-apt-kicad.log "${apt[@]}" install --no-install-recommends -t bookworm-backports "${packages[@]}"
  quietly hw-apt.log "${apt[@]}" install --no-install-recommends "${plain[@]}"
}

{ kicad_ready && pictures_ready; } || install_packages
kicad_ready || stop "kicad-cli 9 with pcbnew still not found"

inputs="$(cat .ci/requirements-hw.txt .ci/constraints-hw.txt | sha256sum | cut -c1-64)"
if ! grep -qsx "$inputs" .venv-hw/setup-done; then
  say "installing CAD into .venv-hw (850 MB, about a minute)"
  quietly hw-venv.log python3 -m venv --clear .venv-hw
  quietly hw-pip.log .venv-hw/bin/pip install --disable-pip-version-check --progress-bar off \
    --constraint .ci/constraints-hw.txt -r .ci/requirements-hw.txt
  printf '%s\n' "$inputs" >.venv-hw/setup-done
fi
say "done"
