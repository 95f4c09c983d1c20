#!/usr/bin/env bash
# install-deps: the one list of Debian packages that building and testing needs. Idempotent; asks the network only when
# something is missing.
# Usage:  deploy/install-deps.sh           install what is missing (as root, or through sudo)
#         deploy/install-deps.sh --list    print the packages this machine needs, one a line, and change nothing
# Exit:   0 all there, 1 an installation failed or is not permitted, 2 usage.
set -euo pipefail

packages=(
  build-essential cmake ninja-build ca-certificates
  libboost1.81-dev          # server/http: Asio, Beast (the default 1.74 is too old)
  nlohmann-json3-dev        # server/api, client
  libeigen3-dev librandom123-dev libxxhash-dev libhwy-dev libspng-dev libtbb-dev   # engine
  libtiff-dev zlib1g-dev libturbojpeg0-dev libopencv-core-dev libopencv-imgproc-dev   # engine/analysis: real images; engine/picture: OME-TIFF
  libexpat1-dev             # engine/analysis: the scale that an OME-TIFF states
  libsqlite3-dev sqlite3                                     # server/store; the shell reads the database in the tests
  libspdlog-dev libtomlplusplus-dev                          # server
  libssl-dev                # server/http: TLS, and tokens' randomness and hashes
  libtinygltf-dev                                            # server/api: meshes as GLB
  libcli11-dev libcurl4-openssl-dev                          # client
  libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev   # tests
  openssl nginx slowhttptest   # tests/system: certificates, a proxy in front, slow clients (nginx is not started, see below)
  libij-java openjdk-17-jre-headless python3-tifffile   # tests/system: what biologists read OME-TIFF with (ImageJ without its window; 52 MB to fetch)
  clang-16 libclang-rt-16-dev libfuzzer-16-dev   # tests/fuzz (46 MB to fetch; clang-14 cannot compile the <ranges> of this libstdc++)
)

# The system tests need Node 18 or later; one from elsewhere is as good as Debian's and is left alone.
node_major="$(node --version 2>/dev/null | sed -n 's/^v\([0-9]*\)\..*/\1/p' || true)"
if [ "${node_major:-0}" -lt 18 ]; then packages+=(nodejs); fi
if [ "${node_major:-0}" -lt 18 ] || ! command -v npm >/dev/null 2>&1; then packages+=(npm); fi

case "${1:-}" in
  --list) printf '%s\n' "${packages[@]}"; exit 0 ;;
  "") ;;
  *) echo "usage: deploy/install-deps.sh [--list]" >&2; exit 2 ;;
esac

release="$(. /etc/os-release 2>/dev/null && echo "${ID:-unknown} ${VERSION_ID:-}" || echo unknown)"
if [ "$release" != "debian 12" ]; then
  echo "install-deps: warning: made for Debian 12, this is '$release'; package names and versions may differ" >&2
fi
if ! command -v dpkg-query >/dev/null 2>&1; then
  echo "install-deps: this machine has no dpkg; install these by its own means: ${packages[*]}" >&2
  exit 1
fi

is_installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ]; }
installed="$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null \
  | sed -n 's/ installed$//p' || true)"
missing=()
for package in "${packages[@]}"; do
  grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
done
if [ "${#missing[@]}" -eq 0 ]; then
  echo "install-deps: all ${#packages[@]} packages are installed"
  exit 0
fi
echo "install-deps: missing: ${missing[*]}"

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null 2>&1; then
    echo "install-deps: installing needs root and there is no sudo; as root run: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

# The two -dev packages own the same files, so Debian lets only one be installed.
if [[ " ${missing[*]} " == *" libboost1.81-dev "* ]] && is_installed libboost1.74-dev; then
  echo "install-deps: NOTE: installing libboost1.81-dev REMOVES libboost1.74-dev (and what needs it) from this machine"
fi

apt_get() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 "$@"
}
# nginx is a tool of the tests here and no service: Debian would start it on port 80. A policy for the time of the installation
# forbids that; one that is there already is left alone.
policy=/usr/sbin/policy-rc.d
if [[ " ${missing[*]} " == *" nginx "* ]] && [ ! -e "$policy" ]; then
  "${as_root[@]}" sh -c "printf '#!/bin/sh\nexit 101\n' >$policy && chmod +x $policy"
  trap '"${as_root[@]}" rm -f "$policy"' EXIT
fi

# Images without manual pages lack the folder that Java's installation links into.
if [[ " ${missing[*]} " == *" openjdk-17-jre-headless "* ]]; then "${as_root[@]}" mkdir -p /usr/share/man/man1; fi

# A package list may be old or, on a fresh machine, empty.
apt_get -q update
apt_get -q -y install --no-install-recommends "${missing[@]}"

for package in "${missing[@]}"; do
  is_installed "$package" || { echo "install-deps: $package is still not installed" >&2; exit 1; }
done
echo "install-deps: installed ${#missing[@]} packages"
