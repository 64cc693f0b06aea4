# SPDX-License-Identifier: Apache-2.0
# Read by tools/test and tools/demo: stops at the first error, and always ends with one clear line.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
export HOME=${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}
caches=${XDG_CACHE_HOME:-$HOME/.cache}/farpoint
export CCACHE_DIR=${CCACHE_DIR:-$caches/ccache}
recordings=$(realpath -m "$root/../shared/data")

doing="starting"
# step TEXT: what is being done, for the reader now and for the last line if it fails.
step() {
  doing=$1
  printf '\n== %s: %s (%d s)\n' "$script" "$doing" "$SECONDS"
}

ended_well=
# finish TEXT: the last line of a run that went well.
finish() {
  ended_well=yes
  printf '%s: %s\n' "$script" "$*"
}

say_how_it_ended() {
  local status=$?
  if [ -z "$ended_well" ]; then
    [ "$status" != 0 ] || status=1
    printf '%s: FAILED while %s\n' "$script" "$doing"
    exit "$status"
  fi
}
trap say_how_it_ended EXIT

# A core a job, and 1.5 GB of memory a job: the largest sources need that much.
jobs=$(nproc)
memory_jobs=$(awk '/MemAvailable/ {print int($2 / 1572864)}' /proc/meminfo)
[ "$memory_jobs" -ge "$jobs" ] || jobs=$((memory_jobs > 1 ? memory_jobs : 1))

# build PRESET [TARGET...]
build() {
  local preset=$1
  shift
  cmake --preset "$preset" > "$root/build/$preset.configure.log" 2>&1 || { cat "$root/build/$preset.configure.log"; return 1; }
  cmake --build --preset "$preset" --parallel "$jobs" ${1:+--target "$@"}
}
mkdir -p "$root/build"
